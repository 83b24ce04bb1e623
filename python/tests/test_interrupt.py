"""Ctrl-C in every long call: it ends soon, and the next call gives the numbers that it gave before."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

CALLS = """
import os, signal, sys, threading, time, warnings
import numpy as np
import excite

# a shell starts what runs in the background with Ctrl-C ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
warnings.simplefilter("ignore")
name = sys.argv[1]
robot = excite.Robot.load("planar2")
plan = excite.design(robot, starts=1, collision=False, harmonics=3, seed=1)
payload = [0.8, 0.02, 0, 0.1, 0.002, 0, 0, 0.002, 0, 0.002]

def records(periods, rate):
    empty = excite.simulate(robot, plan, periods=periods, rate=rate).record(name="empty")
    loaded = excite.simulate(robot, plan, periods=periods, rate=rate, payload=payload).record(name="loaded")
    return [empty, loaded]

def tile(record, times):
    t = np.asarray(record.t)
    step = t[1] - t[0]
    many = {k: np.tile(np.asarray(getattr(record, k)), (times, 1)) for k in ("q", "tau")}
    return excite.Record(t=t[0] + step * np.arange(len(t) * times), **many)

def seen(n):
    # a point of an arm of two links, at another length than the nominal one
    q = np.random.default_rng(1).uniform(-1.2, 1.2, (n, 2))
    a, b = q[:, 0], q.sum(axis=1)
    values = np.column_stack([0.51 * np.cos(a) + 0.3 * np.cos(b), 0 * a, -0.51 * np.sin(a) - 0.3 * np.sin(b)])
    return [{"kind": "position", "q": q, "values": values + 1e-5 * np.sin(37 * np.arange(3 * n)).reshape(n, 3)}]

few = records(2, 100)
work = {
    "simulate": (lambda big: excite.simulate(robot, plan, periods=5000 if big else 2, rate=100).q),
    "identify": (lambda big: excite.identify(excite.Experiment(robot, many[:1] if big else few[:1])).base_values),
    "diagnose": (lambda big: excite.diagnose(excite.Experiment(robot, many if big else few), next=False).claims),
    "condense": (lambda big: excite.condense(excite.Experiment(robot, many if big else few)).data),
    "load": (lambda big: excite.load(excite.Experiment(robot, many if big else few), parameters="mass-com").mass),
    "calibrate": (lambda big: excite.calibrate(
        robot=robot, frame="link2", measurements=seen(20000 if big else 40), effects=[]).to_json()),
}[name]
many = [tile(r, 400) for r in few] if name not in ("simulate", "calibrate") else []
before = work(False)
begin, sent = time.time(), []

def send():
    sent.append(time.time())
    os.kill(os.getpid(), signal.SIGINT)

threading.Timer(0.2, send).start()
try:
    work(True)
    print("ended by itself after", time.time() - begin)
except KeyboardInterrupt:
    after = time.time() - sent[0]
    assert np.all(work(False) == before)
    print("interrupted", after)
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
@pytest.mark.parametrize("name", ["simulate", "identify", "diagnose", "condense", "load", "calibrate"])
def test_ctrl_c_ends_the_call(name: str) -> None:
    done = subprocess.run([sys.executable, "-c", CALLS, name], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    word, after = done.stdout.split()[0], float(done.stdout.split()[-1])
    assert word == "interrupted", done.stdout
    assert after < 1.0, done.stdout
