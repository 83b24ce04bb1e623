"""The functions: the commands of the program, with its options as keyword arguments."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any, Dict, Mapping, Optional, Sequence, Union

from . import _excite
from ._arguments import (
    ExperimentLike,
    RobotLike,
    TrajectoryLike,
    _integer,
    _numbers,
    _optional,
    _pressure,
    _real,
    _real_or_none,
    _robot,
)
from ._arrays import vector
from ._errors import emit, unusable
from ._planned import Assessment, Design, Export, Interrupted
from ._progress import Bar, Progress
from ._records import as_experiment
from ._results import CONTROLLERS, Calibration, Diagnosis, Identification, Load, PoseDiagnosis
from ._robot import PathLike, _names
from ._trajectory import Motion, Trajectory, as_trajectory

def robots() -> Dict[str, str]:
    """Names of the bundled robots, and what they are."""
    return dict(_excite.robots())


def formats() -> Dict[str, str]:
    """Formats of controllers that :func:`export` writes, and what they are."""
    return dict(_excite.formats())


def design(
    robot: RobotLike,
    *,
    purpose: Optional[str] = None,
    payload: Any = None,
    harmonics: Optional[int] = None,
    period: Optional[float] = None,
    periods: Optional[int] = None,
    grid: str = "full",
    diagnostic: bool = False,
    ends: str = "rest",
    coordinates: Optional[str] = None,
    start: Any = None,
    criterion: str = "known",
    condition: Optional[str] = None,
    derate: float = 0.9,
    rate: float = 1000.0,
    seed: int = 1,
    starts: Optional[int] = None,
    time_limit: Optional[float] = None,
    threads: int = 0,
    identify: Optional[Sequence[str]] = None,
    collision: bool = True,
    meshes: Sequence[PathLike] = (),
    progress: Progress = None,
) -> Design:
    """Design an exciting trajectory, inside all limits for all time (``excite design``).

    The same seed gives the same trajectory as the program and on any number of threads, unless a time limit ends the
    run. Ctrl-C ends it early: :class:`Interrupted` (a ``KeyboardInterrupt``) has the best design so far in ``best``.

    Args:
        robot: an :class:`excite.Robot`, a path, or a bundled name.
        purpose: what the motion is for (``--for``): ``"load"``, ``"platform"``, ``"legs"``, ``"friction"``; all base parameters
            where left out. Sets criterion, unknowns, harmonics, period and periods.
        payload: the load that ``purpose="load"`` is about: kg, centre of mass (m) and tensor about it (kg m²), 4 or 10
            numbers; an ordinary one where left out.
        harmonics: of the Fourier series of each joint; 8 for the criterion ``"known"``, 5 for others and with ``diagnostic``, or
            what serves the purpose.
        period: s; 10, or what serves the purpose.
        periods: of the experiment; 1, 3 with ``diagnostic``, or what gives a minute for the purpose.
        grid: harmonics used: ``"full"``, ``"odd"``, ``"random-odd"``.
        diagnostic: also make the motions that :func:`diagnose` wants, in ``motions``; all of odd harmonics.
        ends: ``"rest"`` (zero velocity and acceleration) or ``"free"``.
        coordinates: what moves of a parallel robot: ``"platform"`` or ``"actuators"``.
        start: posture at the start, rad or m, ``(coordinates,)``; free where left out.
        criterion: ``"known"`` (as many parameters as can be known to 10 %), ``"condition"``, ``"d"``, ``"a"``, ``"e"``.
        condition: matrix that the other criteria judge: ``"invariant"``, ``"raw"``, ``"normalised"``, ``"weighted"``.
        derate: fraction of every limit that may be used.
        rate: of ``samples.csv``, Hz.
        seed: of the random starts.
        starts: most starts; 12, from 8 harmonics on 8, where neither this nor a time limit is given.
        time_limit: wall clock of the optimisation, s.
        threads: 0 for one a core.
        identify: joint columns, for all joints: of armature, viscous, coulomb, offset; ``()`` for none; as in the robot
            file where left out.
        collision: whether the robot must keep clear of itself and of what stands around.
        meshes: folders in which ``package://`` meshes are looked for first.
        progress: a bar of tqdm where somebody looks (``None``), always, never, or a function ``(done, of, words)``.
    """
    own = _robot(robot)
    if identify is not None:
        own = own.with_terms(_names("identify", identify))
    if coordinates is not None:
        own = own.in_space(coordinates)
    if not collision:
        own = own.without_collisions()
    elif meshes:
        own = own.with_meshes(meshes)
    if purpose is not None and (diagnostic or criterion != "known" or condition is not None):
        raise unusable("purpose chooses the criterion: diagnostic, criterion and condition cannot be stated with it")
    if diagnostic and grid != "full":
        raise unusable("diagnostic chooses odd harmonics: grid cannot be stated with it")
    with Bar(progress, "design") as bar:
        report, text, motions, experiment, signal = _excite.design(
            own._plant,
            purpose=purpose,
            payload=None if payload is None else _numbers("payload", payload),
            harmonics=_optional("harmonics", harmonics),
            period=_real_or_none("period", period),
            periods_=_optional("periods", periods),
            grid=grid,
            diagnostic=bool(diagnostic),
            ends=ends,
            start=None if start is None else vector("start", start).tolist(),
            criterion=criterion,
            condition=condition,
            derate=_real("derate", derate),
            rate=_real("rate", rate),
            seed=_integer("seed", seed),
            starts=_optional("starts", starts),
            time_limit=_real_or_none("time_limit", time_limit),
            threads=_integer("threads", threads),
            spec=own._named(),
            progress=bar.report,
        )
    further = [
        Motion(name, "holdout" if holdout else "fit", about, Trajectory(json))
        for name, holdout, about, json in motions
    ]
    result = Design(report, own, Trajectory(text), further, experiment, float(rate))
    if signal is not None:
        if isinstance(signal, KeyboardInterrupt):
            raise Interrupted(result) from None
        signal.best = result  # type: ignore[attr-defined]
        raise signal
    emit(result.warnings)
    return result


def assess(
    robot: RobotLike,
    trajectory: Optional[TrajectoryLike] = None,
    *,
    payload: Any = None,
    identify: Optional[Sequence[str]] = None,
    collision: bool = True,
    meshes: Sequence[PathLike] = (),
) -> Assessment:
    """What a robot can tell, and with a trajectory how well, and whether all limits hold for all time
    (``excite identifiability``). Arguments as for :func:`design`; with ``payload`` also how well the trajectory tells
    this load."""
    own = _robot(robot)
    if identify is not None:
        own = own.with_terms(_names("identify", identify))
    if not collision:
        own = own.without_collisions()
    elif meshes:
        own = own.with_meshes(meshes)
    text = None if trajectory is None else as_trajectory(trajectory).to_json()
    load = None if payload is None else _numbers("payload", payload)
    if load is not None and text is None:
        raise unusable("a payload is told by a trajectory: state one")
    result = Assessment(_excite.assess(own._plant, text, load))
    emit(result.warnings)
    return result


def identify(
    experiment: ExperimentLike,
    *,
    method: str = "wls",
    consistency: str = "entropic",
    prior: Optional[float] = None,
    cutoff: Optional[float] = None,
    position_cutoff: Optional[float] = None,
    average: bool = True,
    derive: bool = False,
    identify: Optional[Sequence[str]] = None,
    atmosphere: float = 101_325.0,
) -> Identification:
    """Identify the model from recorded runs (``excite identify``).

    Args:
        experiment: an :class:`excite.Experiment`, or the path of an ``experiment.toml``.
        method: ``"ols"``, ``"wls"``, ``"robust"``, ``"ml"`` (maximum likelihood from the scatter of periods), ``"iv"``.
        consistency: ``"entropic"``, ``"lmi"``, or ``"free"`` for none.
        prior: strength of the prior: 4 for nominal values good to 50 %, 100 for 10 %; by cross-validation where left out.
        cutoff: of the filter that torque and regressor pass, Hz.
        position_cutoff: of the positions, Hz.
        average: whether periods of a motion that repeats are averaged.
        derive: derive velocities and accelerations from positions even where they were measured.
        identify: joint columns, for all joints: of armature, viscous, coulomb, offset; ``()`` for none; as in the robot
            file where left out.
        atmosphere: pressure outside of the cylinders, Pa, for records with chamber pressures in place of forces.
    """
    core = as_experiment(experiment)._native
    result = Identification(
        _excite.identify(
            core,
            method=method,
            consistency=consistency,
            prior=_real_or_none("prior", prior),
            cutoff=_real_or_none("cutoff", cutoff),
            position_cutoff=_real_or_none("position_cutoff", position_cutoff),
            average=bool(average),
            derive=bool(derive),
            identify=None if identify is None else _names("identify", identify),
            atmosphere=_pressure(atmosphere),
        )
    )
    emit(result.warnings)
    return result


def load(
    experiment: ExperimentLike,
    *,
    parameters: str = "full",
    method: str = "one-step",
    unweighted: bool = False,
    unconstrained: bool = False,
    unchecked: bool = False,
    standstill: Optional[float] = None,
    atmosphere: float = 101_325.0,
    position_cutoff: Optional[float] = None,
    cutoff: Optional[float] = None,
    controllers: Sequence[str] = (),
    flange: Any = None,
) -> Load:
    """Identify the load that a robot carries (``excite load``).

    Records with ``payload="unknown"`` carry it; records with ``"none"`` are of the empty robot; records with a known
    payload identify the gains of the drives first.

    Args:
        parameters: ``"full"`` or ``"mass-com"``.
        method: ``"one-step"``, or ``"two-step"`` for platforms.
        unweighted: do not take weight from samples near standstill.
        unconstrained: give the estimate as it is, even if no rigid body could have it.
        unchecked: go on where the log fits the robot only if it is read otherwise than stated.
        standstill: mean speed at which samples begin to count in the two steps, rad/s or m/s.
        atmosphere: pressure outside of the cylinders, Pa.
        position_cutoff, cutoff: of the filters, Hz; ``inf`` for none.
        controllers: also save the load for ``"franka"``, ``"ur"``, ``"kuka"``.
        flange: where the flange is in the frame of the body that carries the load: x, y, z (m), roll, pitch, yaw (rad).
    """
    core = as_experiment(experiment)._native
    wanted = _names("controllers", controllers)
    for name in wanted:
        if name not in CONTROLLERS:
            raise unusable(f"controllers are {', '.join(CONTROLLERS)}, not `{name}`")
    positive = {"standstill": standstill, "position_cutoff": position_cutoff, "cutoff": cutoff}
    for what, value in positive.items():
        if value is not None and not _real(what, value) > 0:
            raise unusable(f"{what} must be positive, not {value}")
    result = Load(
        _excite.load(
            core,
            parameters=parameters,
            method=str(method).replace("-", "_"),
            weighted=not unweighted,
            consistent=not unconstrained,
            checked=not unchecked,
            standstill=_real_or_none("standstill", standstill),
            atmosphere=_pressure(atmosphere),
            position_cutoff=_real_or_none("position_cutoff", position_cutoff),
            cutoff=_real_or_none("cutoff", cutoff),
            flange=[0.0] * 6 if flange is None else vector("flange", flange, 6).tolist(),
        ),
        wanted,
    )
    emit(result.warnings)
    return result


def diagnose(
    experiment: ExperimentLike,
    *,
    next: bool = True,
    next_tries: int = 64,
    samples: int = 0,
    seed: int = 1,
    atmosphere: float = 101_325.0,
    progress: Progress = None,
) -> Diagnosis:
    """Diagnose the gap between a model and its robot: where it lies, which effect causes it, how far it shrinks, what to
    run next (``excite diagnose``).

    Args:
        experiment: an experiment; or the path of a ``calibration.toml``, which is diagnosed for the geometry that the robot
            lacks and gives a :class:`PoseDiagnosis` (``next`` and ``seed`` alone are asked for then).
        next: whether the next motion is designed.
        next_tries: random steps by which the best design of it is improved.
        samples: robots to draw from what the records do not exclude, for what you randomise (:attr:`Diagnosis.samples`):
            effects and their rivals by their confidence, all values with them.
        seed: of the random starts of that motion, and of the samples.
        atmosphere: pressure outside of the cylinders, Pa, for records with chamber pressures in place of forces.
        progress: as for :func:`design`.
    """
    samples = _integer("samples", samples)
    if isinstance(experiment, (str, os.PathLike)) and _excite.is_calibration(Path(os.fspath(experiment))):
        if samples:
            raise unusable("samples are of an experiment; this is a calibration")
        poses = PoseDiagnosis(
            _excite.diagnose_poses(Path(os.fspath(experiment)), next=bool(next), seed=_integer("seed", seed))
        )
        emit(poses.warnings)
        return poses
    core = as_experiment(experiment)._native
    with Bar(progress, "diagnose") as bar:
        report = _excite.diagnose(
            core,
            next=bool(next),
            next_tries=_integer("next_tries", next_tries),
            samples=samples,
            seed=_integer("seed", seed),
            atmosphere=_pressure(atmosphere),
            progress=bar.report,
        )
    result = Diagnosis(report)
    emit(result.warnings)
    return result


def calibrate(
    calibration: Union[PathLike, None] = None,
    *,
    robot: Optional[RobotLike] = None,
    measurements: Sequence[Mapping[str, Any]] = (),
    distances: Sequence[Mapping[str, Any]] = (),
    frame: Optional[str] = None,
    other: Optional[str] = None,
    gravity: Optional[str] = None,
    effects: Optional[Sequence[str]] = None,
    tolerances: Optional[Mapping[str, float]] = None,
    algorithm: str = "inverse",
    orientation: bool = True,
) -> Calibration:
    """Identify the geometry of a robot from what was seen or touched (``excite calibrate``).

    Args:
        calibration: path of a ``calibration.toml``; or, instead of it, what such a file holds:
        robot: the robot.
        measurements: one dictionary a placement: ``kind`` (``"pose"``, ``"position"``, ``"point"``, ``"plane"``,
            ``"gauge"``, ``"loop"``), ``q`` (readings, rad or m, ``(rows, joints)``), ``values`` (pose ``x y z qw qx qy qz``, position
            ``x y z``, m, or ``reading``, m; ``(rows, columns)``; none for points, planes and loops), and if wanted ``use``,
            ``group``, ``std`` (m), ``angle_std`` (rad), ``instrument``, ``cov`` (``(rows, 6, 6)`` of poses),
            ``base_at`` and ``target_at`` (``x y z qw qx qy qz`` of the base in the instrument's frame and of the target in
            the frame that is measured, where they are known) and their ``base_at_std`` and ``target_at_std`` (m, rad);
            of loops ``hold``, ``grip``, ``grip_std``.
        distances: ``{"between": (0, 1), "value": m, "std": m}`` between the points of two measurements, by their place.
        frame: name of the frame that the measurement sees.
        other: of loops: name of the second arm's frame.
        gravity: robot whose inertia tells the torques of gravity.
        effects: of ``"joint_compliance"``, ``"encoder_eccentricity"``, ``"backlash"``, ``"link_compliance"``; those of the
            first three that the data bear out where left out.
        tolerances: ``length``, ``pose_length`` (m), ``angle``, ``pose_angle`` (rad): what is known beforehand.
        algorithm: of parallel robots: ``"inverse"``, ``"implicit"``, ``"forward"``.
        orientation: whether the measured orientation of a parallel robot is kept to one that it can take.
    """
    if calibration is not None:
        if robot is not None or measurements:
            raise unusable("give the path of a calibration.toml, or robot and measurements, not both")
        report = _excite.calibrate(Path(os.fspath(calibration)), algorithm=algorithm, orientation=bool(orientation))
    else:
        if robot is None or not measurements:
            raise unusable("a calibration needs the path of a calibration.toml, or robot and measurements")
        from ._calibration import write

        with tempfile.TemporaryDirectory() as folder:
            path = write(
                Path(folder), _robot(robot), measurements, distances, frame, other, gravity, effects, tolerances
            )
            try:
                report = _excite.calibrate(path, algorithm=algorithm, orientation=bool(orientation))
            except _excite.Error as e:
                error = _excite.Error(str(e).replace(folder + os.sep, ""))
                error.kind = e.kind
                raise error from None
    result = Calibration(report)
    emit(result.warnings)
    return result


def export(
    trajectory: TrajectoryLike,
    format: str,
    *,
    robot: Optional[RobotLike] = None,
    rate: Optional[float] = None,
    periods: Optional[int] = None,
    speed: float = 1.0,
    approach: Optional[PathLike] = None,
    retreat: Optional[PathLike] = None,
    joints: Optional[Sequence[str]] = None,
    columns: Optional[Sequence[str]] = None,
    unit: Sequence[str] = (),
    move_to_start: bool = False,
) -> Export:
    """A trajectory as the file that a controller reads (``excite export``).

    Args:
        format: one of :func:`formats`.
        robot: needed for the motion of a platform and for ``unit``.
        rate: samples a second, Hz; chosen so that the deviation between them is small enough where left out.
        periods: as in the trajectory where left out.
        speed: fraction of the speed of the design.
        approach, retreat: files of moves to the start and back, with the columns ``t, q1 …, dq1 …, ddq1 …``.
        joints: by name, in the order of the controller.
        columns: of ``csv`` (t, q, dq, ddq), or what points of ``ros2`` have.
        unit: of ``csv``: rad or deg, m or mm.
        move_to_start: begin the program with a slow move to the start (urscript, xarm); nobody looks for obstacles.
    """
    motion = as_trajectory(trajectory)
    own = None if robot is None else _robot(robot)._plant
    raw = _excite.export(
        motion.to_json(),
        format,
        own,
        rate=_real_or_none("rate", rate),
        periods=_optional("periods", periods),
        speed=_real("speed", speed),
        approach=None if approach is None else Path(os.fspath(approach)),
        retreat=None if retreat is None else Path(os.fspath(retreat)),
        joints=None if joints is None else _names("joints", joints),
        columns=None if columns is None else _names("columns", columns),
        units=_names("unit", unit),
        move_to_start=bool(move_to_start),
    )
    result = Export(raw)
    emit(result.warnings)
    return result
