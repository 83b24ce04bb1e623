"""Batches of states: against finite differences, against one another, in any layout."""

from __future__ import annotations

import numpy as np
import pytest

import excite


@pytest.mark.parametrize("name", ["planar2", "ur5e", "delta"])
def test_regressor_times_parameters_is_the_torque(name):
    robot = excite.Robot.load(name)
    q, dq, ddq = robot.random_states(40, seed=3)
    y = robot.regressor(q, dq, ddq)
    assert y.shape == (40, len(robot.joints), len(robot.parameters))
    tau = robot.torque(q, dq, ddq, robot.values)
    known = robot.torque(q, dq, ddq, 0 * robot.values)
    np.testing.assert_allclose(y @ robot.values + known, tau, rtol=1e-9, atol=1e-9 * np.abs(tau).max())
    np.testing.assert_allclose(robot.torque(q, dq, ddq), tau, rtol=1e-8, atol=1e-8 * np.abs(tau).max())


def test_base_parameters_give_the_same_torque(robot):
    q, dq, ddq = robot.random_states(40, seed=1)
    y, base = robot.regressor(q, dq, ddq), robot.base()
    pi = base.project(robot.values)
    np.testing.assert_allclose(pi, base.values, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(y[:, :, base.kept] @ pi, y @ robot.values, rtol=1e-8, atol=1e-8)
    assert np.linalg.matrix_rank(y.reshape(-1, y.shape[2]), tol=1e-8) == len(base.kept)


def test_layouts_do_not_matter(robot):
    q, dq, ddq = robot.random_states(30, seed=2)
    expected = robot.torque(q, dq, ddq)
    layouts = [np.ascontiguousarray, np.asfortranarray, lambda a: a[::-1].copy()[::-1], lambda a: a.tolist(),
               lambda a: np.repeat(a, 2, axis=0)[::2], lambda a: np.hstack([a, a])[:, :2]]
    for layout in layouts:
        assert np.array_equal(robot.torque(layout(q), layout(dq), layout(ddq)), expected)
    assert robot.torque(q.astype(np.float32), dq, ddq) == pytest.approx(expected, rel=1e-4, abs=1e-4)
    assert np.array_equal(robot.torque(q[0], dq[0], ddq[0]), expected[:1])
    assert robot.torque([1, 0]).shape == (1, 2)


def test_a_regressor_is_not_copied(robot):
    y = robot.regressor(*robot.random_states(1000))
    base = y
    while base.base is not None and isinstance(base.base, np.ndarray):
        base = base.base
    assert not base.flags.owndata, "its memory belongs to the library"
    assert np.shares_memory(base, y) and y[:, 0, 0].flags.c_contiguous
    y[0, 0, 0] = 1.0  # and it can be written


def test_empty_and_wrong(robot):
    assert robot.regressor(np.zeros((0, 2))).shape[0] == 0
    assert robot.torque(np.zeros((0, 2))).shape == (0, 2)
    for wrong in (np.zeros(3), np.zeros((2, 3)), np.zeros((2, 2, 2)), "text", [[1], [1, 2]], 1j * np.ones((2, 2)), None,
                  np.array([[1.0, np.nan]]), np.array([[1.0, np.inf]]), object(), [["a", "b"]]):
        with pytest.raises(excite.Error) as e:
            robot.torque(wrong)
        assert e.value.kind == "argument", wrong
    with pytest.raises(excite.Error, match="differ in shape"):
        robot.torque(np.zeros((2, 2)), np.zeros((3, 2)))
    with pytest.raises(excite.Error, match="parameters"):
        robot.torque(np.zeros((2, 2)), parameters=[1.0])
    with pytest.raises(excite.Error, match=r"q\[0, 1\] is nan"):
        robot.torque([[0.0, np.nan]])


def test_trajectory_samples_are_derivatives(plan):
    s = plan.trajectory.sample(2000.0)
    assert s.q.shape == (len(s.t), 2) and s.t[-1] == plan.trajectory.duration
    d = np.gradient(s.q, s.t, axis=0)
    assert np.abs(d - s.dq)[2:-2].max() < 1e-4 * np.abs(s.dq).max()
    d = np.gradient(s.dq, s.t, axis=0)
    assert np.abs(d - s.ddq)[2:-2].max() < 1e-4 * np.abs(s.ddq).max()
    again = plan.trajectory.sample(t=s.t[10:20])
    assert np.array_equal(again.q, s.q[10:20])


def test_identified_robot_goes_on(experiment, logs):
    model = excite.identify(experiment)
    q, dq, ddq = model.robot.random_states(20)
    same = experiment.robot.with_terms(["viscous", "coulomb", "offset"])
    np.testing.assert_allclose(
        model.robot.torque(q, dq, ddq), same.torque(q, dq, ddq, model.values), rtol=1e-6, atol=1e-6)
    assert len(model.names) == len(model.values) == len(model.std)
    b = len(model.base_names)
    assert model.base_covariance.shape == (b, b)
    assert model.validation["holdout"]["relative_error"] < 0.5
    assert excite.design(model.robot, starts=1, period=4).satisfied
