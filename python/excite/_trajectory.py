"""Trajectories."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Union

import numpy as np

from . import _excite
from ._arrays import Array, from_columns, vector
from ._errors import unusable

#: Most samples of one call.
_ROWS = 10_000_000


class Samples(NamedTuple):
    """A sampled motion of the coordinates."""

    t: Array
    """times, s, ``(samples,)``"""
    q: Array
    """positions, rad or m, ``(samples, coordinates)``"""
    dq: Array
    """velocities, the same shape"""
    ddq: Array
    """accelerations, the same shape"""


class Trajectory:
    """A designed motion: a Fourier series for each coordinate. What ``trajectory.json`` holds."""

    def __init__(self, text: str, *, name: str = "trajectory") -> None:
        """From the text of a ``trajectory.json``."""
        self._text = _excite.check_trajectory(text, name)
        self._value: Dict[str, Any] = json.loads(self._text)

    @classmethod
    def read(cls, path: Union[str, "os.PathLike[str]"]) -> "Trajectory":
        """Read a ``trajectory.json``."""
        try:
            text = Path(path).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as e:
            raise unusable(f"{os.fspath(path)}: {e}") from None
        return cls(text, name=os.fspath(path))

    @classmethod
    def from_dict(cls, value: Dict[str, Any]) -> "Trajectory":
        """From what :meth:`to_dict` gives."""
        try:
            return cls(json.dumps(value))
        except (TypeError, ValueError) as e:
            raise unusable(f"trajectory: {e}") from None

    def to_json(self) -> str:
        """The text of ``trajectory.json``."""
        return self._text

    def to_dict(self) -> Dict[str, Any]:
        """What ``trajectory.json`` holds."""
        value: Dict[str, Any] = json.loads(self._text)
        return value

    def save(self, path: Union[str, "os.PathLike[str]"], *, force: bool = False) -> Path:
        """Write ``trajectory.json``; a file that exists is replaced with ``force`` alone."""
        path = Path(path)
        return _excite.save(path.parent, [(path.name, self._text.encode())], [], force)[0]

    @property
    def robot(self) -> str:
        """Name of the robot that it was designed for."""
        return str(self._value["robot"])

    @property
    def coordinates(self) -> List[str]:
        """Names of what it moves."""
        return list(self._value["joints"])

    @property
    def period(self) -> float:
        """Period, s."""
        return float(self._value["period"])

    @property
    def periods(self) -> int:
        """How many periods run."""
        return int(self._value["periods"])

    @property
    def duration(self) -> float:
        """Duration of all periods, s."""
        return self.period * self.periods

    @property
    def harmonics(self) -> List[int]:
        """Harmonics of the series."""
        return list(self._value["harmonics"])

    @property
    def coefficients(self) -> Array:
        """Constant, sines, cosines of each coordinate, rad or m, ``(coordinates, 1 + 2 harmonics)``."""
        rows = [[c["constant"], *c["sin"], *c["cos"]] for c in self._value["coefficients"]]
        return np.array(rows)

    def sample(self, rate: float = 1000.0, *, t: Any = None) -> Samples:
        """Positions, velocities, accelerations at ``rate`` Hz over all periods, both ends included, or at times ``t``."""
        if t is None:
            times = self._times(rate)
        else:
            times = vector("t", t)
        flat = _excite.sample(self._text, np.ascontiguousarray(times))
        q, dq, ddq = (from_columns(f, len(self._value["joints"])) for f in flat)
        return Samples(times, q, dq, ddq)

    def _times(self, rate: float) -> Array:
        steps = self.duration * float(rate)
        if not (rate > 0 and steps < _ROWS):
            raise unusable(f"rate must be a positive number of Hz that gives less than {_ROWS} samples, not {rate}")
        whole = round(steps) if abs(steps - round(steps)) < 1e-6 else int(np.ceil(steps))
        return np.append(np.arange(whole) / float(rate), self.duration)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Trajectory) and self._text == other._text

    def __hash__(self) -> int:
        return hash(self._text)

    def __reduce__(self) -> Any:
        return Trajectory, (self._text,)

    def __repr__(self) -> str:
        return f"<excite.Trajectory of {self.robot}: {self.periods} x {self.period} s, harmonics {self.harmonics}>"


class Motion(NamedTuple):
    """A motion of the set that a diagnosis wants."""

    name: str
    """stem of its files"""
    use: str
    """what its record is for, ``"fit"`` or ``"holdout"``"""
    about: str
    """what it is for, in words"""
    trajectory: Trajectory


def as_trajectory(value: Any) -> Trajectory:
    """A trajectory from what a user has: itself, a design, a path, or a dictionary."""
    inner: Optional[Any] = getattr(value, "trajectory", None)
    if isinstance(inner, Trajectory):
        return inner
    if isinstance(value, Trajectory):
        return value
    if isinstance(value, dict):
        return Trajectory.from_dict(value)
    if isinstance(value, (str, os.PathLike)):
        return Trajectory.read(value)
    raise unusable(f"a trajectory is an excite.Trajectory, a design, a path or a dict, not {type(value).__name__}")
