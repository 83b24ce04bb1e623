"""What Python expects: exceptions, warnings, Ctrl-C, threads, processes, pickles, frames, notebooks."""

from __future__ import annotations

import json
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import warnings

import numpy as np
import pytest

import excite

T = np.arange(400) / 100.0
Q = np.column_stack([np.sin(3 * T), np.cos(2 * T)])


def record(**changes):
    return excite.Record(**{"t": T, "q": Q, "tau": 2 * Q, **changes})


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"t": T[:10]}, "one row for each time"),
        ({"t": []}, "not empty"),
        ({"t": T.reshape(20, 20)}, "one-dimensional"),
        ({"q": Q[:, :1]}, "columns"),
        ({"q": np.zeros((400, 0))}, "joints"),
        ({"q": "text"}, "real numbers"),
        ({"q": 1j * Q}, "real numbers"),
        ({"q": 0 * Q}, "nothing moves"),
        ({"q": np.nan * Q}, "holds no number"),
        ({"tau": None}, "tau1"),
        ({"tau": np.hstack([Q, Q])}, "columns"),
        ({"t": 0 * T}, "time stamp"),
        ({"t": np.nan * T}, "time"),
        ({"period": -1.0}, "period"),
        ({"period": float("nan")}, "period"),
        ({"use": "train"}, "holdout"),
        ({"payload": "heavy"}, "payload"),
        ({"payload": {"mass": -1.0}}, "mass"),
        ({"payload": {"mass": 1.0, "inertia": [0.0] * 6}}, "com"),
        ({"payload": {"mass": 1.0, "com": [0.0, np.nan, 0.0]}}, "finite"),
        ({"pose": Q}, "7"),
    ],
)
def test_bad_records(robot, changes, words):
    with pytest.raises(excite.Error, match=words):
        excite.identify(excite.Experiment(robot, [record(**changes)]))


def test_wrong_number_of_joints():
    with pytest.raises(excite.Error, match="another robot|joints"):
        excite.identify(excite.Experiment(excite.Robot.load("ur5e"), [record()]))


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: excite.design("nobody"), "bundled"),
        (lambda: excite.design(7), "excite.Robot"),
        (lambda: excite.design("planar2", harmonics=0), "harmonics"),
        (lambda: excite.design("planar2", harmonics=2.5), "whole number"),
        (lambda: excite.design("planar2", period=float("nan")), "period"),
        (lambda: excite.design("planar2", derate=0), "derate"),
        (lambda: excite.design("planar2", criterion="best"), "criterion"),
        (lambda: excite.design("planar2", grid="even"), "grid"),
        (lambda: excite.design("planar2", start=[0.0]), "start posture"),
        (lambda: excite.design("planar2", start=[0.0, np.nan]), "finite"),
        (lambda: excite.design("planar2", identify=["glue"]), "glue"),
        (lambda: excite.design("planar2", rate=-1), "rate"),
        (lambda: excite.design("planar2", seed=-1), "seed"),
        (lambda: excite.design("planar2", threads=10**9), "threads"),
        (lambda: excite.design("planar2", coordinates="platform"), "platform"),
        (lambda: excite.design("planar2", diagnostic=True, grid="odd"), "diagnostic"),
        (lambda: excite.assess("planar2", "nowhere.json"), "nowhere.json"),
        (lambda: excite.assess("planar2", {"format": "other"}), "trajectory"),
        (lambda: excite.Robot.from_urdf("<robot"), "robot"),
        (lambda: excite.Robot.from_urdf("nowhere.urdf"), "nowhere.urdf"),
        (lambda: excite.Robot.load(""), "no robot"),
        (lambda: excite.Trajectory("{}"), "format"),
        (lambda: excite.identify("nowhere.toml"), "nowhere.toml"),
        (lambda: excite.Experiment("planar2", [record()]), "Robot.load"),
        (lambda: excite.Experiment(excite.Robot.load("planar2"), []), "at least one"),
        (lambda: excite.Experiment(excite.Robot.load("planar2"), [3]), "records"),
        (lambda: excite.calibrate(), "measurements"),
        (lambda: excite.calibrate("nowhere.toml"), "nowhere.toml"),
    ],
)
def test_bad_arguments(call, words):
    with pytest.raises(excite.Error, match=words):
        call()


def test_bad_rehearsals(robot, plan):
    for settings, words in [
        ({"rate": 0}, "rate"),
        ({"rate": float("inf")}, "rate"),
        ({"step": -1.0}, "step"),
        ({"periods": 0}, "periods"),
        ({"noise": float("nan")}, "noise"),
        ({"payload": [1.0]}, "payload"),
        ({"payload": [-1.0, 0, 0, 0]}, "payload"),
        ({"joint_offset": {"elbow": 1.0}}, "elbow"),
        ({"joint_offset": {"joint1": np.nan}}, "finite"),
        ({"gravity_direction": (0.1, 9.0)}, "right angle"),
        ({"controller": "magic"}, "controller"),
        ({"monte_carlo": 0}, "monte_carlo"),
        ({"pose": True}, "platform"),
    ]:
        with pytest.raises(excite.Error, match=words):
            excite.simulate(robot, plan, **settings)
    with pytest.raises(excite.Error):
        excite.simulate("ur5e", plan)
    with pytest.raises(excite.Error, match="there is no format"):
        excite.export(plan, "papyrus")


def test_errors_have_kinds(plan, tmp_path):
    plan.trajectory.save(tmp_path / "t.json")
    with pytest.raises(excite.Error, match="exists already") as e:
        plan.trajectory.save(tmp_path / "t.json")
    assert e.value.kind == "exists"
    plan.trajectory.save(tmp_path / "t.json", force=True)
    assert excite.Trajectory.read(tmp_path / "t.json") == plan.trajectory
    with pytest.raises(excite.Error) as e:
        excite.Robot.load("a/nowhere.urdf")
    assert e.value.kind == "io"
    again = pickle.loads(pickle.dumps(e.value))
    assert isinstance(again, excite.Error) and str(again) == str(e.value)


def test_warnings_are_pythons_and_carried(robot, plan):
    log = excite.simulate(robot, plan, periods=2, rate=250)
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        found = excite.identify(excite.Experiment(robot, [log]))
    texts = [str(w.message) for w in seen if issubclass(w.category, excite.ExciteWarning)]
    assert texts and texts[: len(found.warnings)] == [str(w) for w in found.warnings][: len(texts)]
    assert [w.kind for w in found.warnings] == [w["kind"] for w in found.to_dict()["warnings"]]
    assert seen[0].filename == __file__


def test_progress(robot, plan):
    told = []
    excite.design(robot, starts=2, period=4, progress=lambda *a: told.append(a))
    assert told[-1][1] == 2 and "starts" in told[-1][2]
    told.clear()
    excite.simulate(robot, plan, periods=2, progress=lambda *a: told.append(a))
    assert len(told) > 2 and 0 <= told[0][0] <= told[-1][0] <= 1

    def stop(*_):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        excite.simulate(robot, plan, periods=2, progress=stop)
    excite.design(robot, starts=1, period=4, progress=True)


INTERRUPTED = """
import excite, os, signal, threading, time, warnings
# a shell starts what runs in the background with Ctrl-C ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
warnings.simplefilter("ignore")
told = threading.Event()
def look(done, of, words):
    told.set()
def send():
    told.wait(60)
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=send, daemon=True).start()
begin = time.time()
try:
    excite.design("planar2", starts=100000, progress=look)
except KeyboardInterrupt as e:
    assert type(e) is excite.Interrupted
    assert e.best.status == "interrupted" and e.best.satisfied, e.best.status
    assert e.best.trajectory.sample(100).q.shape[1] == 2
    print("kept", len(e.best.to_dict()["starts"]))
try:
    e = None
    plan = excite.design("planar2", starts=1)
    threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    begin = time.time()
    excite.simulate("planar2", plan, periods=2000, rate=100)
except KeyboardInterrupt as e:
    assert time.time() - begin < 5, time.time() - begin
    print("ended")
log = excite.simulate("planar2", plan, periods=2)
print("usable", len(log.t))
"""


def test_ctrl_c_keeps_the_best():
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["kept", "ended", "usable"], done.stdout


def test_ctrl_c_ends_the_program(tmp_path):
    if not hasattr(signal, "SIGINT") or os.name == "nt":
        pytest.skip("signals of another kind")
    run = subprocess.Popen(
        [sys.executable, "-m", "excite", "design", "planar2", "--time-limit", "60", "--output", str(tmp_path / "out")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    time.sleep(3)
    run.send_signal(signal.SIGINT)
    out, err = run.communicate(timeout=30)
    assert run.returncode == 0, err
    assert "interrupted; this is the best so far" in out and (tmp_path / "out/trajectory.json").exists()


def test_the_lock_is_released(robot):
    """Another thread runs while a design does."""
    ticks, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            ticks[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    begin = time.time()
    excite.design(robot, starts=3, period=4)
    seconds = time.time() - begin
    stop.set()
    thread.join()
    assert ticks[0] > 0.1 * seconds / 0.001 / 2, (ticks, seconds)


def test_many_threads_at_once(robot, plan):
    results = [None] * 4

    def work(k):
        results[k] = excite.design(robot, starts=2, period=4, seed=1, identify=["viscous", "coulomb"]).trajectory

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert all(r == plan.trajectory for r in results)


def designed(seed):
    plan = excite.design("planar2", starts=1, period=4, seed=seed)
    q, dq, ddq = excite.Robot.load("planar2").random_states(300)
    return plan, excite.Robot.load("planar2").regressor(q, dq, ddq).sum()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_processes_that_were_forked(robot):
    """Threads do not live on in a forked process; calls there must not wait for them."""
    here = [designed(k) for k in (1, 2)]
    with multiprocessing.get_context("fork").Pool(2) as pool:
        there = pool.map_async(designed, [1, 2]).get(timeout=120)
    for a, b in zip(here, there):
        assert a[0].trajectory == b[0].trajectory and a[1] == b[1]
        assert a[0].satisfied and b[0].html.startswith("<!DOCTYPE html>")


def test_pickles(robot, plan, logs, experiment, tmp_path):
    q = robot.random_states(5)[0]
    for r in (robot, robot.with_terms(["viscous"]).without_collisions(), excite.Robot.load("delta")):
        again = pickle.loads(pickle.dumps(r))
        assert again.parameters == r.parameters and again.name == r.name
    assert np.array_equal(pickle.loads(pickle.dumps(robot)).torque(q), robot.torque(q))
    again = pickle.loads(pickle.dumps(plan))
    assert again.to_dict() == plan.to_dict() and again.trajectory == plan.trajectory and again.html == plan.html
    again.save(tmp_path / "again")
    model = excite.identify(experiment)
    other = excite.identify(pickle.loads(pickle.dumps(experiment)))
    assert other.files == model.files
    again = pickle.loads(pickle.dumps(model))
    assert np.array_equal(again.values, model.values)
    assert np.array_equal(again.robot.torque(q), model.robot.torque(q))
    improved = pickle.loads(pickle.dumps(model.robot))
    assert np.array_equal(improved.torque(q), model.robot.torque(q))
    assert np.array_equal(pickle.loads(pickle.dumps(logs[0])).q, logs[0].q)


def test_frames(plan, experiment, logs):
    pytest.importorskip("pandas")
    frame = logs[0].to_frame()
    assert list(frame.columns) == ["t", "q1", "q2", "tau1", "tau2", "qref1", "qref2"]
    again = excite.Record.from_frame(frame, use="holdout")
    assert np.array_equal(again.q, logs[0].q) and again.use == "holdout"
    model = excite.identify(experiment)
    assert set(model.to_frame()["kind"]) == {"base", "standard", "joint"}
    assert len(plan.to_frame()) == plan.base_parameters
    frame = excite.diagnose(experiment, next=False).to_frame()
    assert "effect" in frame.columns


def test_notebook_shows_the_report(plan, experiment):
    page = plan._repr_html_()
    assert page.startswith("<iframe") and 'srcdoc="&lt;!DOCTYPE' in page
    assert "<iframe" in excite.identify(experiment)._repr_html_()
    assert "planar2" in excite.simulate("planar2", plan, periods=1)._repr_html_()
    assert "planar2" in repr(plan) and "planar2" in repr(plan.trajectory)


def test_experiment_of_a_file(chain):
    read = excite.Experiment.read(chain.folder / "experiment.toml")
    first, second = read.records
    assert first.use == "fit" and second.use == "holdout" and first.period == 4.0
    assert np.asarray(first.q).shape == (3000, 2)
    assert excite.identify(read).files["model.json"] == excite.identify(
        excite.Experiment(excite.Robot.load("planar2"), read.records)).files["model.json"]


def test_dropped_values_are_repaired_and_said(robot, logs):
    tau = np.array(logs[0].tau)
    tau[100:110, 0] = np.nan
    found = excite.identify(excite.Experiment(robot, [logs[0].but(tau=tau)]))
    assert any(w.kind == "samples_left_out" for w in found.warnings)


def test_robot_of_text(robot, tmp_path, experiment):
    files = excite.identify(experiment).files
    of_text = excite.Robot.from_urdf(files["robot.urdf"])
    (tmp_path / "arm.urdf").write_text(files["robot.urdf"])
    of_file = excite.Robot.from_urdf(tmp_path / "arm.urdf")
    assert of_text.joints == of_file.joints == robot.joints
    q = robot.random_states(5)[0]
    assert np.array_equal(of_text.torque(q), of_file.torque(q))
    found = excite.design(of_text, starts=1, period=4, diagnostic=True)
    found.save(tmp_path / "gap")
    assert (tmp_path / "gap/robot.urdf").exists() and 'robot = "robot.toml"' in (tmp_path / "gap/experiment.toml").read_text()


def test_import_is_quick():
    code = "import time; b = time.perf_counter(); import excite; print(time.perf_counter() - b)"
    best = min(
        float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
        for _ in range(3)
    )
    assert best < 1.0, f"{best} s"  # 0.2 s on a machine that does nothing else


def test_version_and_lists():
    assert excite.__version__
    assert "panda" in excite.robots() and "urscript" in excite.formats()
    assert json.loads(json.dumps(excite.Robot.load("delta").limits))
    for name in excite.__all__:
        assert getattr(excite, name) is not None
