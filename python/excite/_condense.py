"""Records as triangular factors that add, and the model from them."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Dict, Iterable, List, Optional, Sequence, Union

from . import _excite
from ._arguments import ExperimentLike, RobotLike, _pressure, _real_or_none, _robot
from ._arrays import Array, floats
from ._errors import emit, notices, unusable
from ._records import as_experiment
from ._results import _Model
from ._robot import PathLike, Robot, _names


class Factor:
    """Condensed records: about 200 kB for seven joints, in place of a log of any length. It can be pickled."""

    def __init__(self, data: bytes) -> None:
        #: what the file holds
        self.data = bytes(data)
        #: robot, records, cut-off and columns, as in the file
        self.info: Dict[str, Any] = json.loads(_excite.header(self.data))

    @classmethod
    def read(cls, path: PathLike) -> "Factor":
        """Read a file of ``excite condense`` or :meth:`save`."""
        try:
            return cls(Path(os.fspath(path)).read_bytes())
        except OSError as e:
            raise unusable(f"cannot read {os.fspath(path)}: {e}") from None

    def save(self, path: PathLike, *, force: bool = False) -> List[Path]:
        """Write it to a file."""
        path = Path(os.fspath(path))
        return _excite.save(path.parent, [(path.name, self.data)], [], force)

    def __repr__(self) -> str:
        records = sum(len(p["records"]) for p in self.info["parts"])
        return f"<excite.Factor of {records} records, {len(self.data)} bytes>"


class Merged(_Model):
    """A model from condensed records."""

    _file = "merged.json"
    _may = ("robot.urdf", "robot.xml", "robot.toml", "effects.py")

    @property
    def robot(self) -> Robot:
        """The identified robot, for every other function."""
        return self._robot_of_files()

    @property
    def names(self) -> List[str]:
        """Names of the parameters."""
        return [p["name"] for p in self._value["parameters"]]

    @property
    def values(self) -> Array:
        """Values of the parameters, those of a robot that can exist, ``(p,)``."""
        return floats(p["value"] for p in self._value["parameters"])

    @property
    def std(self) -> Array:
        """Their standard deviations: data and prior, ``(p,)``."""
        return floats(p["std"] for p in self._value["parameters"])

    @property
    def base_values(self) -> Array:
        """Base parameters by least squares alone, ``(b,)``."""
        return floats(p["unconstrained"] for p in self._value["base_parameters"])

    @property
    def base_std(self) -> Array:
        """Their standard deviations, ``(b,)``."""
        return floats(p["std"] for p in self._value["base_parameters"])

    @property
    def validation(self) -> Dict[str, Any]:
        """Errors of the filtered equations, of the fit and the holdout records."""
        value: Dict[str, Any] = self._value["validation"]
        return value


def condense(
    experiment: ExperimentLike,
    *,
    cutoff: Optional[float] = None,
    average: bool = True,
    derive: bool = False,
    identify: Optional[Sequence[str]] = None,
    atmosphere: float = 101_325.0,
) -> Factor:
    """Reduce records to triangular factors that add (``excite condense``).

    Args:
        cutoff: of the filter that torque and regressor pass, Hz; factors with the same one add.
        average: the periods of motion that repeats.
        derive: velocities and accelerations from positions even where the records have them.
        identify: joint columns for all joints, as for :func:`identify`.
        atmosphere: pressure outside of the cylinders, Pa.
    """
    data, warnings = _excite.condense(
        as_experiment(experiment)._native,
        cutoff=_real_or_none("cutoff", cutoff),
        average=bool(average),
        derive=bool(derive),
        identify=None if identify is None else _names("identify", identify),
        atmosphere=_pressure(atmosphere),
    )
    emit(notices(warnings))
    return Factor(data)


def merge(
    factors: Iterable[Union[Factor, PathLike]],
    *,
    robot: Optional[RobotLike] = None,
    method: str = "wls",
    consistency: str = "entropic",
    prior: Optional[float] = None,
) -> Merged:
    """Identify the model from any number of condensed records (``excite merge``).

    The base parameters are those that :func:`identify` finds from all records at once with the same ``cutoff``.

    Args:
        factors: of :func:`condense`, or their files.
        robot: as it was named to :func:`condense` where left out.
        method: ``"wls"`` or ``"ols"``.
        consistency, prior: as for :func:`identify`.
    """
    read = [f if isinstance(f, Factor) else Factor.read(f) for f in factors]
    if not read:
        raise unusable("no factor is given; make some with excite.condense")
    own = _robot(read[0].info["robot"] if robot is None else robot)
    result = Merged(
        _excite.merge(
            own._plant,
            [f.data for f in read],
            method=method,
            consistency=consistency,
            prior=_real_or_none("prior", prior),
            identify=read[0].info["identify"],
        )
    )
    emit(result.warnings)
    return result
