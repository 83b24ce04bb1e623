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


def test_samples_of_a_diagnosis_have_its_effects(experiment, tmp_path):
    robot = experiment.robot
    plans = [excite.design(robot, seed=s, starts=2, period=4, identify=["viscous", "coulomb"]) for s in (1, 2)]
    logs = []
    for plan, use in zip(plans, ["fit", "holdout"]):
        run = excite.simulate(robot, plan, periods=3, rate=250, perturb=0.05).record(use, name=use)
        tau = np.array(run.tau)
        tau[:, 1] *= 1.25
        logs.append(run.but(tau=tau))
    found = excite.diagnose(excite.Experiment(robot, logs), next=False, samples=12)
    drawn = found.samples
    assert len(drawn) == 12 and excite.diagnose(excite.Experiment(robot, logs), next=False).samples is None
    assert any(drawn.effects) and found.claims[0]["effect"] in {e["effect"] for s in drawn.effects for e in s}
    assert 0.85 < drawn.coverage["covered"] < 1.0
    # a row is the robot of its files
    own = [drawn.names.index(p.name) for p in robot.parameters]
    q, dq = np.array([[0.3, -0.8]]), np.array([[0.4, 0.2]])
    for k in range(12):
        assert drawn.sampled(k).torque(q, dq) == pytest.approx(robot.torque(q, dq, None, drawn.values[k, own]), rel=1e-9)
        assert any(np.isfinite(drawn.values[k, len(own) :])) == bool(drawn.effects[k])
    found.save(tmp_path)
    again = excite.Diagnosis.read(tmp_path).samples
    assert np.array_equal(again.values, drawn.values, equal_nan=True) and again.files(11) == drawn.files(11)
    drawn.save(tmp_path / "own")
    assert (tmp_path / "own/samples.csv").read_text() == (tmp_path / "samples.csv").read_text()
    with pytest.raises(excite.Error):
        excite.diagnose(excite.Experiment(robot, logs), samples=-1)
