"""What was recorded: arrays of a run, and experiments of several."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _excite
from ._arrays import Array, columns, numbers, pandas
from ._errors import Notice, notices, unusable
from ._robot import PathLike, Robot

#: Channels with one column an actuator, with their unit.
CHANNELS = ("q", "tau", "dq", "ddq", "qref", "ql", "pa", "pb")
POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")

Payload = Union[None, str, Mapping[str, Any]]


@dataclass(frozen=True, eq=False)
class Record:
    """One run as it was logged: times and channels of the actuated joints, in the robot's order.

    A value that was not measured may be NaN: it is interpolated for the filters and left out of the fit. Time stamps may
    jitter and have gaps, which is reported.
    """

    t: Any
    """times, s, ``(samples,)``"""
    q: Any
    """measured positions, rad or m, ``(samples, joints)``"""
    tau: Any = None
    """measured torques or forces, N m or N, the same shape; left out where there are pressures"""
    dq: Any = None
    """measured velocities, where there are any"""
    ddq: Any = None
    """measured accelerations, where there are any"""
    qref: Any = None
    """commanded positions, where there are any"""
    ql: Any = None
    """link-side positions, where there is a second encoder"""
    pose: Any = None
    """pose of platform or tool, x y z qw qx qy qz, ``(samples, 7)``"""
    pa: Any = None
    """chamber pressures of cylinders, Pa, ``(samples, joints)``"""
    pb: Any = None
    """the other chambers"""
    use: str = "fit"
    """``"fit"``, or ``"holdout"``: predicted only"""
    period: Optional[float] = None
    """period of the motion, s, where it repeats"""
    payload: Payload = None
    """what the robot carried: ``"none"``, ``"unknown"``, or ``{"mass": 2.0, "com": (0, 0, 0.05)}`` (kg, m) with
    ``"inertia"`` about the centre of mass (xx, xy, xz, yy, yz, zz, kg m²)"""
    part: Tuple[Optional[float], Optional[float]] = (None, None)
    """the part that counts, s from the start"""
    name: str = field(default="record")
    """what messages call it"""

    @classmethod
    def from_frame(cls, frame: Any, **settings: Any) -> "Record":
        """From a pandas ``DataFrame`` or a dictionary of columns with the names of a log: ``t, q1, …, tau1, …``."""
        names = [str(c) for c in (frame.columns if hasattr(frame, "columns") else frame)]
        given: Dict[str, Any] = {}
        for channel in CHANNELS:
            own = [n for n in names if n[: len(channel)] == channel and n[len(channel) :].isdigit()]
            if own:
                own.sort(key=lambda n: int(n[len(channel) :]))
                given[channel] = np.column_stack([numbers(n, frame[n]) for n in own])
        if all(n in names for n in POSE):
            given["pose"] = np.column_stack([numbers(n, frame[n]) for n in POSE])
        if "t" not in names or "q" not in given:
            raise unusable(f"a log has columns t, q1, …, tau1, …; these are {', '.join(names)}")
        return cls(numbers("t", frame["t"]), **{**given, **settings})

    def to_frame(self) -> Any:
        """A pandas ``DataFrame`` with the columns of a log."""
        names, data = self._table()
        return pandas().DataFrame(dict(zip(names, data)))

    def to_csv(self, path: PathLike, *, force: bool = False) -> Path:
        """Write it as a log that every command reads."""
        path = Path(path)
        names, data = self._table()
        text = _excite.table(names, data)
        return _excite.save(path.parent, [(path.name, text.encode())], [], force)[0]

    def but(self, **settings: Any) -> "Record":
        """The same record with other settings: ``record.but(use="holdout")``."""
        return replace(self, **settings)

    def _table(self) -> Tuple[List[str], List[Array]]:
        t = numbers("t", self.t)
        if t.ndim != 1 or len(t) == 0:
            raise unusable(f"t must be one-dimensional and not empty; its shape is {t.shape}")
        names, data = ["t"], [np.ascontiguousarray(t)]
        width: Optional[int] = None
        for channel in CHANNELS:
            value = getattr(self, channel)
            if value is None:
                continue
            array = numbers(channel, value)
            if array.ndim == 1:
                array = array[:, None]
            if array.ndim != 2 or array.shape[0] != len(t) or array.shape[1] == 0:
                raise unusable(
                    f"{channel} must have the shape ({len(t)}, joints), one row for each time; its shape is "
                    f"{np.shape(value)}"
                )
            if width is not None and array.shape[1] != width:
                raise unusable(f"{channel} has {array.shape[1]} columns, q has {width}")
            width = array.shape[1]
            names += [f"{channel}{k + 1}" for k in range(width)]
            data += columns(array)
        if self.pose is not None:
            pose = numbers("pose", self.pose)
            if pose.shape != (len(t), 7):
                raise unusable(f"pose must have the shape ({len(t)}, 7); its shape is {pose.shape}")
            names += list(POSE)
            data += columns(pose)
        return names, data

    def _native(self) -> Dict[str, Any]:
        if self.use not in ("fit", "holdout"):
            raise unusable(f'use is "fit" or "holdout", not {self.use!r}')
        period = None if self.period is None else float(self.period)
        if period is not None and not (np.isfinite(period) and period > 0):
            raise unusable(f"period is {self.period}; it must be positive, in seconds")
        names, data = self._table()
        return {
            "name": str(self.name),
            "names": names,
            "columns": data,
            "holdout": self.use == "holdout",
            "period": period,
            "part": list(self.part),
            "payload": _payload(self.payload),
        }


def _payload(payload: Payload) -> Optional[Dict[str, Any]]:
    if payload is None or payload == "none":
        return None
    if payload == "unknown":
        return {"mass": None, "com": None, "inertia": None}
    form = 'payload is "none", "unknown" or {"mass": 2.0, "com": (0, 0, 0.05), "inertia": (…)}'
    if not isinstance(payload, Mapping) or "mass" not in payload or set(payload) - {"mass", "com", "inertia"}:
        raise unusable(f"{form}, not {payload!r}")
    from ._arrays import pandas, vector

    body: Dict[str, Any] = {"mass": float(payload["mass"]), "com": None, "inertia": None}
    if not (np.isfinite(body["mass"]) and body["mass"] > 0):
        raise unusable(f"the payload's mass is {payload['mass']} kg; it must be positive")
    for key, length in (("com", 3), ("inertia", 6)):
        if payload.get(key) is not None:
            body[key] = vector(f"payload {key}", payload[key], length).tolist()
    if body["inertia"] is not None and body["com"] is None:
        raise unusable("the payload's inertia is about its centre of mass: state com, too")
    return body


class Experiment:
    """A robot and what was recorded of it."""

    def __init__(self, robot: Robot, records: Sequence[Any]) -> None:
        """From arrays: ``records`` are :class:`Record`, simulations, or frames with the columns of a log."""
        if not isinstance(robot, Robot):
            raise unusable(f"robot is an excite.Robot (Robot.load), not {type(robot).__name__}")
        self._robot: Optional[Robot] = robot
        self._path: Optional[str] = None
        listed = records if isinstance(records, (list, tuple)) else [records]
        self._records = [_record(r, k) for k, r in enumerate(listed)]
        if not self._records:
            raise unusable("an experiment needs at least one record")
        self._core: Optional[_excite.Experiment] = None

    @classmethod
    def read(cls, path: PathLike) -> "Experiment":
        """Read an ``experiment.toml``, its robot and its logs, of any format that ``excite log`` knows."""
        self = cls.__new__(cls)
        self._path = str(Path(os.fspath(path)).absolute())
        self._robot = None
        self._records = []
        self._core = _excite.Experiment.read(Path(os.fspath(path)))
        return self

    @property
    def _native(self) -> _excite.Experiment:
        if self._core is None:
            if self._path is not None:
                self._core = _excite.Experiment.read(Path(self._path))
            else:
                assert self._robot is not None
                given = [r._native() for r in self._records]
                self._core = _excite.Experiment.of(self._robot._plant, given)
        return self._core

    @property
    def robot(self) -> Optional[Robot]:
        """The robot; ``None`` where the experiment was read from a file, which names it."""
        return self._robot

    @property
    def records(self) -> List[Record]:
        """The records as they are used: repaired and on an even grid of time."""
        return [_repaired(d) for d in self._native.records()]

    @property
    def warnings(self) -> List[Notice]:
        """What was imperfect in robot and logs."""
        return notices(self._native.warnings())

    def __getstate__(self) -> Dict[str, Any]:
        return {**self.__dict__, "_core": None}

    def __repr__(self) -> str:
        if self._path is not None:
            return f"<excite.Experiment {self._path}>"
        return f"<excite.Experiment: {len(self._records)} records of {self._robot.name if self._robot else ''}>"


def _repaired(d: Dict[str, Any]) -> Record:
    arrays: Dict[str, Any] = {c: np.column_stack(d[c]) for c in (*CHANNELS, "pose") if d.get(c)}
    use = "holdout" if d["holdout"] else "fit"
    return Record(d["t"], use=use, period=d["period"], payload=d.get("payload"), name=d["name"], **arrays)


def _record(value: Any, k: int) -> Record:
    if callable(getattr(value, "record", None)):
        value = value.record()
    if isinstance(value, Mapping) or hasattr(value, "columns"):
        value = Record.from_frame(value)
    if not isinstance(value, Record):
        raise unusable(f"records[{k}] is an excite.Record, a simulation or a frame, not {type(value).__name__}")
    return value.but(name=f"record_{k + 1}") if value.name == "record" else value


def as_experiment(value: Any) -> Experiment:
    """An experiment from what a user has: itself, or the path of an ``experiment.toml``."""
    if isinstance(value, Experiment):
        return value
    if isinstance(value, (str, os.PathLike)):
        return Experiment.read(value)
    raise unusable(f"an experiment is an excite.Experiment or the path of one, not {type(value).__name__}")
