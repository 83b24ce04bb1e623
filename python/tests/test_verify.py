"""The proof in a simulator: against effects that are known, and against simulators that are known."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import excite

PAYLOAD = (0.6, 0.02, 0.0, 0.1, 0.002, 0.0, 0.0, 0.002, 0.0, 0.002)


@pytest.fixture(scope="module")
def hidden():
    """Records of a robot that carries what its model does not know."""
    robot = excite.Robot.load("scara")
    plan = excite.design(robot, starts=1, period=4, diagnostic=True)
    motions = [("fit", plan.trajectory), ("holdout", plan.motions[-1].trajectory)]
    logs = [
        excite.simulate(robot, t, periods=3, rate=250, payload=PAYLOAD).record(use, name=use, payload=None)
        for use, t in motions
    ]
    return excite.Experiment(robot, logs)


@pytest.fixture(scope="module")
def diagnosis(hidden):
    return excite.diagnose(hidden, next=False)


def test_mujoco(hidden, diagnosis, tmp_path):
    pytest.importorskip("mujoco")
    assert diagnosis.claims, diagnosis
    found = excite.verify(hidden, diagnosis=diagnosis, horizons=(0.1, 1.0))
    assert found.claimed > 0.9 and found.shrink > 0.9 * found.claimed
    assert found.to_dict()["command"].startswith("the recorded commands")
    assert [h["seconds"] for h in found.horizons][:2] == pytest.approx([0.1, 1.0], abs=0.01)
    for h in found.horizons:
        assert h["shrink"] > 0.9, h
    for joint in found.to_dict()["torque"]["joints"]:
        # the same gap of the nominal model, by equations of others
        assert joint["nominal"] == pytest.approx(joint["own"], rel=0.02, abs=1.0)
    diagnosis.save(tmp_path / "gap")
    of_files = excite.verify(hidden, diagnosis=tmp_path / "gap", horizons=(0.1, 1.0))
    assert of_files.to_dict() == found.to_dict()
    with pytest.raises(excite.Error, match="no folder of a diagnosis"):
        excite.verify(hidden, diagnosis=tmp_path)
    found.save(tmp_path)
    assert json.loads((tmp_path / "verification.json").read_text())["robot"] == "scara"
    page = (tmp_path / "report.html").read_text()
    assert page.count("<svg") == 2 and "http" not in page.replace("http-equiv", "")
    assert "<iframe" in found._repr_html_() and "torque gap" in repr(found)
    assert pickle.loads(pickle.dumps(found)).to_dict() == found.to_dict()


def test_a_model_that_is_not_improved_shows_no_shrink(hidden, diagnosis):
    """What is claimed is not believed: with the nominal file in the place of the improved one nothing shrinks."""
    pytest.importorskip("mujoco")
    wrong = pickle.loads(pickle.dumps(diagnosis))
    robot = excite.Robot.load("scara")
    wrong._files["robot.xml"] = dict((n, t) for n, t, _ in robot._plant.files(robot.values.tolist()))["robot.xml"]
    wrong._files.pop("effects.py", None)
    found = excite.verify(hidden, diagnosis=wrong, horizons=(0.1,))
    assert found.claimed > 0.9 and abs(found.shrink) < 0.01
    assert all(abs(h["shrink"]) < 0.01 for h in found.horizons)


def hexapod(mass):
    """The bundled hexapod, with its legs or with legs that weigh nothing."""
    here = Path(__file__).resolve().parents[2]
    text = (here / "src/mechanism/bundled/hexapod.toml").read_text(encoding="utf-8")
    if not mass:
        lines = [k for k in text.splitlines() if not k.startswith(("cylinder = ", "rod = "))]
        text = "\n".join(lines).replace('bodies = "legs"', 'bodies = "platform"')
    return excite.Robot._from_files({"robot.toml": 'prior = "identified"\n' + text}, "robot.toml")


def recorded(robot, model, **settings):
    """A record to fit and one held out of a hexapod, for a model of it."""
    here = Path(__file__).resolve().parents[2]
    motion = excite.Trajectory.read(here / "trajectories/hexapod/trajectory.json")
    logs = [
        excite.simulate(robot, motion, periods=2, rate=200, seed=k, **settings).record(use, name=use, payload=None)
        for k, use in enumerate(("fit", "holdout"))
    ]
    return excite.Experiment(model, logs)


@pytest.mark.parametrize("mass", [True, False])
def test_a_parallel_robot_in_mujoco(mass):
    """Legs are closed by constraints, or are tendons where they weigh nothing; a hidden load shows in both."""
    pytest.importorskip("mujoco")
    robot = hexapod(mass)
    load = (7.0, 0.02, -0.03, 0.1, 0.1113, 0.0042, -0.014, 0.1078, 0.021, 0.0651)
    hidden = recorded(robot, robot, payload=load)
    diagnosis = excite.diagnose(hidden, next=False)
    xml = diagnosis.files["robot.xml"]
    assert ("<tendon>" in xml) != mass and ("<connect " in xml) == mass
    found = excite.verify(hidden, diagnosis=diagnosis, horizons=(0.3,), runs=4)
    assert [c["effect"] for c in found.to_dict()["claims"]] == ["payload"]
    assert found.claimed > 0.9 and found.shrink > 0.9 * found.claimed
    torque = found.to_dict()["torque"]["joints"]
    nominal, own = (sum(j[k] for j in torque) for k in ("nominal", "own"))
    assert nominal == pytest.approx(own, rel=0.05)
    for h in found.horizons:
        assert h["shrink"] > 0.9, h


def test_legs_that_were_left_out():
    """Forces leave open how cylinder and rod share their inertia; what is written can exist and closes the gap."""
    pytest.importorskip("mujoco")
    light = hexapod(False)
    hidden = recorded(hexapod(True), light)
    diagnosis = excite.diagnose(hidden, next=False)
    assert [c["effect"] for c in diagnosis.claims] == ["leg_inertia"]
    assert "robot.toml" in diagnosis.files and diagnosis.robot.joints == light.joints
    found = excite.verify(hidden, diagnosis=diagnosis, horizons=(0.3,), runs=2)
    assert found.claimed > 0.9 and found.shrink > 0.9 * found.claimed


def integrate(robot):
    """A simulator of one's own: forward dynamics by the equations of the package."""
    from excite._command import mass

    def run(q0, dq0, command, dt):
        q, dq, out, small = q0.copy(), dq0.copy(), [q0.copy()], 4
        for k in range(command.steps):
            for s in range(small):
                t = (k + s / small) * dt
                ddq = np.linalg.solve(mass(robot, q[None])[0], command(t, q, dq) - robot.torque(q, dq)[0])
                dq = dq + ddq * dt / small
                q = q + dq * dt / small
            out.append(q)
        return np.array(out)

    return run


def test_a_simulator_of_ones_own(hidden, diagnosis):
    pair = (integrate(excite.Robot.load("scara")), integrate(diagnosis.robot))
    found = excite.verify(hidden, pair, diagnosis=diagnosis, horizons=(0.1, 0.3), runs=2)
    assert found.shrink is None, "a function has no inverse dynamics"
    assert found.horizons[0]["shrink"] > 0.8
    alone = excite.verify(hidden, pair[1], diagnosis=diagnosis, horizons=(0.1,), runs=1)
    assert "simulator" in alone.horizons[0]["joints"][0]


def test_bad_simulators(hidden, diagnosis):
    for simulator, words in [
        ("gazebo", "function"),
        (3, "function"),
        (lambda q, dq, c, dt: q, "shape"),
        (lambda q, dq, c, dt: "no", "real numbers"),
    ]:
        with pytest.raises(excite.Error, match=words):
            excite.verify(hidden, simulator, diagnosis=diagnosis, horizons=(0.1,), runs=1)
    with pytest.raises(excite.Error, match="horizons"):
        excite.verify(hidden, diagnosis=diagnosis, horizons=(-1.0,))
    with pytest.raises(ZeroDivisionError):
        excite.verify(hidden, lambda q, dq, c, dt: 1 / 0, diagnosis=diagnosis, horizons=(0.1,), runs=1)
