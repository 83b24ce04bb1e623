"""Samples of the posterior: bodies that can exist, as wide as the data leave it, and a band that covers."""

from __future__ import annotations

import numpy as np
import pytest

import excite
from excite._posterior import pseudo, ten_of


@pytest.fixture(scope="module")
def experiment():
    """A robot whose form is that of its model."""
    robot = excite.Robot.load("planar2")
    settings = {"starts": 2, "period": 4, "identify": ["viscous", "coulomb"]}
    plans = [excite.design(robot, seed=s, **settings) for s in (1, 2)]
    logs = [excite.simulate(robot, p, periods=2, rate=250, perturb=0.2) for p in plans]
    return excite.Experiment(robot, [logs[0].record(), logs[1].record("holdout")])


@pytest.fixture(scope="module")
def model(experiment):
    return excite.identify(experiment)


def test_pseudo_inertia_there_and_back():
    rng = np.random.default_rng(0)
    points, weights = rng.standard_normal((20, 3)), rng.uniform(0, 1, 20)
    h = np.hstack([points, np.ones((20, 1))])
    j = (weights[:, None] * h).T @ h
    ten = ten_of(j)
    assert ten[0] == pytest.approx(weights.sum())
    tensor = sum(w * (p @ p * np.eye(3) - np.outer(p, p)) for w, p in zip(weights, points))
    assert ten[4:] == pytest.approx(tensor[np.triu_indices(3)])
    assert pseudo(ten) == pytest.approx(j)


def test_bodies_can_exist_and_signs_stay(model):
    found = model.sample(200, seed=3)
    assert np.array_equal(found.values, model.sample(200, seed=3).values)
    assert not np.array_equal(found.values, model.sample(200, seed=4).values)
    heads = [k for k, n in enumerate(found.names) if n.endswith(".m")]
    for row in found.values:
        for k in heads:
            j = pseudo(row[k : k + 10])
            assert np.linalg.eigvalsh(j).min() > 0
    for k, name in enumerate(found.names):
        if name.endswith((".viscous", ".coulomb", ".armature")):
            assert (found.values[:, k] >= 0).all()


def test_as_wide_as_the_data_leave_it(model):
    """Base parameters scatter as their covariance says, what is not seen as the prior."""
    found = model.sample(4000, seed=1)
    base = model.robot.base()
    pi = np.array([base.project(v) for v in found.values])
    std = np.sqrt(np.diag(model.base_covariance))
    assert np.all(pi.std(0) < 1.15 * std)
    known = std < 0.02 * np.abs(model.base_values)
    assert known.any() and np.all(pi.std(0)[known] > 0.5 * std[known])
    assert np.all(np.abs(pi.mean(0) - base.project(model.values)) < 0.2 * std + 1e-9)


def test_coverage(model, experiment):
    """On a robot whose form is that of the model, about as much is covered as is promised."""
    found = model.sample(100).coverage(experiment)
    assert 0.90 < found["covered"] < 0.98, found
    assert found["width"] < 0.5
    records = experiment.records
    with pytest.raises(excite.Error, match="held out"):
        model.sample(3).coverage(excite.Experiment(experiment.robot, records[:1]))


def test_files(model, tmp_path):
    found = model.sample(3)
    found.save(tmp_path)
    rows = np.loadtxt(tmp_path / "samples.csv", delimiter=",", skiprows=1)
    assert np.array_equal(rows, found.values)
    assert (tmp_path / "sample_0003/robot.urdf").exists()
    q, dq, ddq = found.robot.random_states(5)
    third = excite.Robot.load(tmp_path / "sample_0003/robot.toml")
    np.testing.assert_allclose(third.torque(q, dq, ddq), found.torque(q, dq, ddq)[2], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found.sampled(2).torque(q, dq, ddq), third.torque(q, dq, ddq), rtol=1e-9, atol=1e-9)


def test_bad(model, experiment):
    for n, seed in ((0, 0), (2.5, 0), (3, -1)):
        with pytest.raises(excite.Error, match="whole numbers"):
            model.sample(n, seed)
    with pytest.raises(excite.Error, match="share"):
        model.sample(2).coverage(experiment, level=2)
