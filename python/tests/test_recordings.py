"""Models of real machines in MuJoCo: on held-out records its inverse dynamics leaves what ours leaves."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import excite
from excite import _excite
from excite._arrays import from_columns
from excite._mujoco import Model

#: A joint counts as moving from this share of its fastest velocity on: below, the sign of the velocity is that of noise.
MOVING = 0.002


def recording(name):
    here = Path(__file__).resolve().parents[2]
    named = os.environ.get("EXCITE_SHARED")
    places = [Path(named)] if named else [here / "../shared", here / "../../shared"]
    found = [p / "data" / name / "experiment.toml" for p in places]
    for path in found:
        if path.exists():
            return path
    pytest.skip(f"../shared/data/{name} is not there")


@pytest.mark.parametrize("name", ["tx40", "emps"])
def test_mujoco_leaves_what_we_leave(name):
    pytest.importorskip("mujoco")
    experiment = excite.Experiment.read(recording(name))
    identified = excite.identify(experiment)
    robot = identified.robot
    files = {n: text for n, text, _ in robot._plant.files(robot.values.tolist())}
    model = Model(files["robot.xml"], None, robot.joints, "identified")
    held = [r for r in _excite.series(experiment._native)["records"] if r["holdout"]]
    assert held
    for r in held:
        q, dq, ddq, tau = (from_columns(r[k], len(robot.joints)) for k in ("q", "dq", "ddq", "tau"))
        moving = (np.abs(dq) > MOVING * np.abs(dq).max(0)) & np.array(r["measured"])[:, None]
        assert moving.mean() > 0.5
        theirs = tau - model.inverse(q, dq, ddq, r["dt"])
        ours = tau - robot.torque(q, dq, ddq)
        gap = [np.sqrt(np.mean(np.where(moving, x, 0.0) ** 2, axis=0)) for x in (theirs, ours)]
        print(name, r["name"], "MuJoCo's gap over ours:", gap[0] / gap[1])
        np.testing.assert_allclose(gap[0], gap[1], rtol=0.02)
        # where a joint stands still, friction is no more wrong there than here
        measured = np.array(r["measured"])
        assert np.linalg.norm(theirs[measured]) < 1.02 * np.linalg.norm(ours[measured])


@pytest.mark.parametrize("name", ["panda", "tx40"])
def test_the_band_of_the_posterior_covers_what_was_held_out(name):
    experiment = excite.Experiment.read(recording(name))
    found = excite.identify(experiment).sample(50, seed=1).coverage(experiment)
    print(name, found["covered"], [(j["joint"], round(j["covered"], 3)) for j in found["joints"]])
    assert 0.90 <= found["covered"] <= 0.97
    assert all(j["covered"] > 0.85 for j in found["joints"])
    # narrower than ±20 % on everything
    assert found["width"] < 0.5
