"""The simulated run of a trajectory."""

from __future__ import annotations

from typing import Any, List, Mapping, Optional, Tuple

from . import _excite
from ._arguments import PerJoint, RobotLike, TrajectoryLike, _integer, _numbers, _optional, _real, _robot
from ._arrays import vector
from ._errors import emit
from ._planned import Simulation
from ._progress import Bar, Progress
from ._trajectory import as_trajectory


def _effect(name: str, value: Any) -> List[str]:
    """An effect as the program states it: ``[JOINT=]NUMBERS``."""
    if value is None:
        return []
    if isinstance(value, Mapping):
        return [f"{joint}={_numbers(name, v)}" for joint, v in value.items()]
    return [_numbers(name, value)]


def simulate(
    robot: RobotLike,
    trajectory: TrajectoryLike,
    *,
    periods: Optional[int] = None,
    lead_in: int = 1,
    rate: float = 1000.0,
    step: float = 2.5e-4,
    controller: str = "feedforward",
    bandwidth: float = 10.0,
    damping: float = 1.0,
    noise: float = 1.0,
    seed: int = 0,
    derivatives: bool = False,
    pose: bool = False,
    payload: Any = None,
    stribeck_friction: PerJoint = None,
    nonlinear_viscous_friction: PerJoint = None,
    friction_asymmetry: PerJoint = None,
    load_dependent_friction: PerJoint = None,
    torque_constant: PerJoint = None,
    joint_offset: PerJoint = None,
    torque_delay: float = 0.0,
    gravity_direction: Optional[Tuple[float, float]] = None,
    perturb: float = 0.0,
    monte_carlo: Optional[int] = None,
    progress: Progress = None,
) -> Simulation:
    """Rehearse an experiment: the robot under a controller, and the log that it would write (``excite simulate``).

    An effect is a number for all joints, or a dictionary by joint: ``joint_offset={"j3": 0.01}``.

    Args:
        robot, trajectory: what moves, and how.
        periods: to log; as in the trajectory where left out.
        lead_in: periods before the log begins.
        rate: samples a second, Hz.
        step: largest step of the integrator, s.
        controller: ``"feedforward"`` or ``"pd"``.
        bandwidth: natural frequency of the tracking error, Hz.
        damping: its damping ratio.
        noise: factor on the torque noise of the robot file; 0: ideal sensors.
        seed: of everything random.
        derivatives: whether the record has true velocities and accelerations.
        pose: whether it has the true pose of the platform (parallel robots).
        payload: load on the last body or platform: mass (kg), centre (m), and tensor about it (xx, xy, xz, yy, yz, zz,
            kg m²): 4 or 10 numbers.
        stribeck_friction: force beyond Coulomb friction (N m or N) and velocity at which it has fallen to 1/e.
        nonlinear_viscous_friction: ``C`` of ``C v |v|``.
        friction_asymmetry: difference of the Coulomb friction between the directions, N m or N.
        load_dependent_friction: ``beta`` of ``beta |torque| sign(v)``.
        torque_constant: factor on the measured torque.
        joint_offset: added to the measured position, rad or m.
        torque_delay: of the measured torque, s.
        gravity_direction: rotation of the base about its x and y axes that the model does not know, rad.
        perturb: random deviation of all bodies and joint terms from the model, up to this fraction.
        monte_carlo: rehearse so many times and compare predicted with achieved spread.
        progress: as for :func:`design`.
    """
    own, motion = _robot(robot), as_trajectory(trajectory)
    effects = {
        "payload": None if payload is None else _numbers("payload", payload),
        "stribeck_friction": _effect("stribeck_friction", stribeck_friction),
        "nonlinear_viscous_friction": _effect("nonlinear_viscous_friction", nonlinear_viscous_friction),
        "friction_asymmetry": _effect("friction_asymmetry", friction_asymmetry),
        "load_dependent_friction": _effect("load_dependent_friction", load_dependent_friction),
        "torque_constant": _effect("torque_constant", torque_constant),
        "joint_offset": _effect("joint_offset", joint_offset),
        "torque_delay": _real("torque_delay", torque_delay),
        "gravity_direction": None,
        "perturb": _real("perturb", perturb),
    }
    if gravity_direction is not None:
        effects["gravity_direction"] = vector("gravity_direction", gravity_direction, 2).tolist()
    with Bar(progress, "simulate") as bar:
        raw = _excite.simulate(
            own._plant,
            motion.to_json(),
            periods=_optional("periods", periods),
            lead_in=_integer("lead_in", lead_in),
            rate=_real("rate", rate),
            step=_real("step", step),
            controller=controller,
            bandwidth=_real("bandwidth", bandwidth),
            damping=_real("damping", damping),
            noise=_real("noise", noise),
            seed=_integer("seed", seed),
            effects=effects,
            pose=bool(pose),
            monte_carlo_=_optional("monte_carlo", monte_carlo, 1),
            progress=bar.report,
        )
    carried = None if payload is None else "unknown"
    result = Simulation(raw, own.name, own.joints, bool(derivatives), carried)
    emit(result.warnings)
    return result
