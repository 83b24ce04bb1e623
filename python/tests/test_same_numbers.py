"""The same numbers as the program, bit for bit: its files, from arrays."""

from __future__ import annotations

import json

import numpy as np
import pytest

import excite


def without_clock(text):
    """A report but for what hangs on the clock and on where files are."""
    value = json.loads(text)
    for key in ("seconds", "warnings", "starts"):
        value.pop(key, None)
    return value


def test_design(chain, plan, tmp_path):
    assert plan.trajectory.to_json() == chain.read("fit/trajectory.json")
    assert without_clock(plan.to_json()) == without_clock(chain.read("fit/report.json"))
    plan.save(tmp_path / "out")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == sorted(
        p.name for p in (chain.folder / "fit").iterdir()
    )
    assert (tmp_path / "out/samples.csv").read_text() == chain.read("fit/samples.csv")


def test_design_is_the_same_on_any_number_of_threads(robot, plan):
    again = excite.design(robot, starts=2, period=4, seed=1, identify=["viscous", "coulomb"], threads=1)
    assert again.trajectory.to_json() == plan.trajectory.to_json()


def test_diagnostic_set(chain, tmp_path):
    settings = ["--starts", "1", "--period", "4"]
    chain("design", "planar2", "--diagnostic", *settings, "--output", "gap")
    found = excite.design("planar2", diagnostic=True, starts=1, period=4)
    found.save(tmp_path / "gap")
    names = sorted(p.name for p in (chain.folder / "gap").iterdir())
    assert sorted(p.name for p in (tmp_path / "gap").iterdir()) == names
    for name in names:
        if not name.startswith("report"):
            assert (tmp_path / "gap" / name).read_text() == chain.read(f"gap/{name}"), name
    assert [m.use for m in found.motions] == ["fit", "fit", "holdout"]


def test_assess(chain, plan):
    chain("identifiability", "planar2", "fit/trajectory.json", "--output", "assessed", "--force")
    found = excite.assess("planar2", plan.trajectory)
    assert without_clock(found.to_json()) == without_clock(chain.read("assessed/report.json"))
    assert found.satisfied is True and found.base_parameters > 0
    assert excite.assess("planar2").satisfied is None


def test_simulate(chain, robot, plan, logs, tmp_path):
    logs[0].to_csv(tmp_path / "record.csv")
    rows = np.loadtxt(chain.folder / "fit.csv", delimiter=",", skiprows=1)
    assert np.array_equal(rows[:, 0], logs[0].t)
    assert np.array_equal(rows[:, 1:3], logs[0].q)
    assert np.array_equal(rows[:, 3:5], logs[0].tau)
    log = excite.simulate(robot, plan, periods=1, rate=100, derivatives=True, noise=0.5, seed=3,
                          joint_offset={"joint2": 0.01}, payload=(0.5, 0.0, 0.0, 0.1), gravity_direction=(0.01, -0.02))
    log.save(tmp_path)
    chain("simulate", "planar2", "fit/trajectory.json", "--periods", "1", "--rate", "100", "--derivatives", "--noise",
          "0.5", "--seed", "3", "--joint-offset", "joint2=0.01", "--payload", "0.5,0,0,0.1", "--gravity-direction",
          "0.01,-0.02", "--output", "one.csv")
    assert (tmp_path / "log.csv").read_text() == chain.read("one.csv")


def test_identify(chain, experiment, tmp_path):
    chain("identify", "experiment.toml", "--output", "model")
    found = excite.identify(experiment)
    assert found.files["model.json"] == chain.read("model/model.json")
    assert without_clock(found.to_json()) == without_clock(chain.read("model/report.json"))
    for name in ("robot.urdf", "robot.toml", "robot.xml"):
        assert found.files[name] == chain.read(f"model/{name}"), name
    of_files = excite.identify(chain.folder / "experiment.toml")
    assert of_files.to_dict()["warnings"] == json.loads(chain.read("model/report.json"))["warnings"]
    found.save(tmp_path / "model")
    assert sorted(p.name for p in (tmp_path / "model").iterdir()) == sorted(
        p.name for p in (chain.folder / "model").iterdir()
    )
    chain("identify", "experiment.toml", "--output", "robust", "--method", "robust", "--prior", "4", "--cutoff", "15")
    again = excite.identify(experiment, method="robust", prior=4, cutoff=15)
    assert again.files["model.json"] == chain.read("robust/model.json")


def test_diagnose(chain, experiment):
    chain("diagnose", "experiment.toml", "--output", "diagnosis", "--next-tries", "4")
    found = excite.diagnose(experiment, next_tries=4)
    assert without_clock(found.to_json()) == without_clock(chain.read("diagnosis/diagnosis.json"))
    for name, text in found.files.items():
        assert text == chain.read(f"diagnosis/{name}"), name
    assert found.claims and found.claims[0]["effect"] == "nonlinear_viscous_friction"


def test_load(chain, robot, plan):
    body = "0.8,0.02,0,0.1,0.002,0,0,0.002,0,0.002"
    for name, more in (("empty", []), ("loaded", ["--payload", body])):
        chain("simulate", "planar2", "fit/trajectory.json", "--periods", "2", "--rate", "250", *more, "--output",
              f"{name}.csv", "--experiment", "load.toml")
    chain("load", "load.toml", "--output", "load", "--parameters", "mass-com")
    empty = excite.simulate(robot, plan, periods=2, rate=250).record(name="empty")
    payload = [float(x) for x in body.split(",")]
    loaded = excite.simulate(robot, plan, periods=2, rate=250, payload=payload).record(name="loaded")
    found = excite.load(excite.Experiment(robot, [empty, loaded]), parameters="mass-com")
    assert without_clock(found.to_json()) == without_clock(chain.read("load/load.json"))
    assert found.mass == pytest.approx(0.8, rel=0.05)


def test_export(chain, plan):
    chain("export", "fit/trajectory.json", "--format", "urscript", "--rate", "100", "--output", "x.script", status=1)
    for name, more in (("csv", {"rate": 100}), ("c", {}), ("ros2", {"speed": 0.5})):
        options = [x for k, v in more.items() for x in (f"--{k}", str(v))]
        if name not in excite.formats():
            continue
        chain("export", "fit/trajectory.json", "--format", name, *options, "--output", f"{name}.out")
        assert excite.export(plan, name, **more).data == (chain.folder / f"{name}.out").read_bytes()


def test_torque(chain, robot, plan):
    chain("torque", "planar2", "fit/samples.csv")
    said = np.loadtxt(chain("torque", "planar2", "fit/samples.csv").splitlines(), delimiter=",", skiprows=1)
    s = plan.trajectory.sample(1000.0)
    assert np.array_equal(said[:, 0], s.t)
    assert np.array_equal(said[:, 1:], robot.torque(s.q, s.dq, s.ddq))


def test_program_of_the_package(chain):
    assert "planar2" in chain("robots")
    assert "harmonics" in chain("design", "--help")
    assert "is neither a file nor a bundled robot" in chain("design", "nobody", status=2)
    assert chain("design", "planar2", "--derate", "2", status=2).startswith("error: derate")
