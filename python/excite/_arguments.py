"""Arguments of the functions: what they may be, and what is made of them."""

from __future__ import annotations

import os
from typing import Any, Dict, Mapping, Optional, Sequence, Union

from ._arrays import vector
from ._errors import unusable
from ._planned import Design
from ._records import Experiment
from ._robot import PathLike, Robot
from ._trajectory import Trajectory

RobotLike = Union[Robot, PathLike]
TrajectoryLike = Union[Trajectory, Design, PathLike, Dict[str, Any]]
ExperimentLike = Union[Experiment, PathLike]
#: A value of all joints, or of some by their names.
PerJoint = Union[None, float, Sequence[float], Mapping[str, Union[float, Sequence[float]]]]


def _robot(value: RobotLike) -> Robot:
    if isinstance(value, Robot):
        return value
    if isinstance(value, (str, os.PathLike)):
        return Robot.load(value)
    raise unusable(f"a robot is an excite.Robot, a path or a bundled name, not {type(value).__name__}")


def _integer(name: str, value: Any, least: int = 0) -> int:
    try:
        number = int(value)
        if number != value or number < least or number >= 2**32:
            raise ValueError
        return number
    except (TypeError, ValueError):
        raise unusable(f"{name} must be a whole number of at least {least}, not {value!r}") from None


def _optional(name: str, value: Any, least: int = 0) -> Optional[int]:
    return None if value is None else _integer(name, value, least)


def _real(name: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise unusable(f"{name} must be a number, not {value!r}") from None


def _pressure(value: Any) -> float:
    pressure = _real("atmosphere", value)
    if not 0 <= pressure < float("inf"):
        raise unusable(f"atmosphere is a pressure in Pa, not {value}")
    return pressure


def _real_or_none(name: str, value: Any) -> Optional[float]:
    return None if value is None else _real(name, value)


def _numbers(name: str, value: Any) -> str:
    listed = vector(name, [value] if _scalar(value) else value)
    return ",".join(repr(float(x)) for x in listed)


def _scalar(value: Any) -> bool:
    try:
        float(value)
        return True
    except (TypeError, ValueError):
        return False
