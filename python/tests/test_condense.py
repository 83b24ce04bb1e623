"""Condensed records: the numbers of all records at once."""

import pickle
import warnings
from pathlib import Path

import numpy as np
import pytest

import excite


def test_merged_factors(tmp_path: Path) -> None:
    robot = excite.Robot.load("planar2").with_terms(["viscous", "coulomb"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", excite.ExciteWarning)
        records = []
        for seed in (1, 2):
            plan = excite.design(robot, starts=1, collision=False, harmonics=3, seed=seed)
            records.append(excite.simulate(robot, plan, periods=2, perturb=0.2, seed=seed).record())
        whole = excite.identify(excite.Experiment(robot, records), cutoff=15.0)
        factors = [excite.condense(excite.Experiment(robot, [r]), cutoff=15.0) for r in records]
        factors = pickle.loads(pickle.dumps(factors))
        factors[0].save(tmp_path / "a.factor")
        merged = excite.merge([tmp_path / "a.factor", factors[1]], robot=robot)
        other = excite.condense(excite.Experiment(robot, records[:1]), cutoff=14.0)
        with pytest.raises(excite.Error, match="cutoff"):
            excite.merge([factors[0], other], robot=robot)
    unconstrained = np.array([p["unconstrained"] for p in whole.model["base_parameters"]])
    assert np.abs(merged.base_values - unconstrained).max() < 1e-10 * np.abs(unconstrained).max()
    assert merged.robot.joints == robot.joints
    assert merged.validation["fit"]["relative_error"] < 0.1
    merged.save(tmp_path / "out")
    assert (tmp_path / "out" / "merged.json").is_file() and (tmp_path / "out" / "robot.toml").is_file()
