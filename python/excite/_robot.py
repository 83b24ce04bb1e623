"""Robots."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _excite
from ._arrays import Array, by_column, finite, from_columns, rows, vector
from ._errors import Notice, notices, unusable

PathLike = Union[str, "os.PathLike[str]"]


class Parameter(NamedTuple):
    """A parameter of the dynamics: ten a link, then the joint terms."""

    name: str
    """``link3.mx``, ``joint2.viscous``"""
    unit: str
    value: float
    """in the robot file"""


class BaseParameters(NamedTuple):
    """What actuator torques can tell of the parameters at all, ``pi = phi[kept] + K phi[dropped]``."""

    names: List[str]
    """of the parameters that are kept, ``b`` of them"""
    combinations: List[str]
    """in words"""
    values: Array
    """of the robot file, ``(b,)``"""
    kept: List[int]
    """columns of the regressor that are kept: ``W[:, kept] @ pi`` is ``W @ phi``"""
    dropped: List[int]
    k: Array
    """``K``, ``(b, p - b)``"""

    def project(self, phi: Any) -> Array:
        """Base parameters ``(b,)`` of parameters ``(p,)``."""
        phi = vector("phi", phi, len(self.kept) + len(self.dropped))
        return np.asarray(phi[self.kept] + self.k @ phi[self.dropped])


class Robot:
    """A robot: arm, tree or parallel, as every function of this package takes it.

    Make it with :meth:`load`, :meth:`from_urdf` or :meth:`from_mjcf`. It does not change; :meth:`with_terms` and the like
    give another one. It can be pickled: a robot of a file is read again from there.
    """

    def __init__(self, _plant: _excite.Plant, _source: Tuple[Any, ...], _changes: Tuple[Any, ...] = ()) -> None:
        self._plant = _plant
        self._source = _source
        self._changes = _changes
        self._card: Dict[str, Any] = json.loads(_plant.card())

    @classmethod
    def load(cls, spec: PathLike) -> "Robot":
        """Read a robot: a ``robot.toml``, a URDF, another robot file, or the name of a bundled one (:func:`robots`)."""
        text = os.fspath(spec)
        plant = _excite.Plant.load(text)
        path = Path(text)
        return cls(plant, ("load", str(path.absolute()) if path.is_file() else text))

    @classmethod
    def from_urdf(cls, urdf: PathLike, toml: Optional[str] = None, *, name: str = "robot") -> "Robot":
        """Read a URDF: its path, or its text.

        ``toml`` is the text of a ``robot.toml`` that adds limits, noise and friction; its entry ``urdf`` is not read.
        """
        text = os.fspath(urdf)
        if "<" not in text:
            if toml is None:
                return cls.load(text)
            try:
                text = Path(text).read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError) as e:
                raise unusable(f"{os.fspath(urdf)}: {e}") from None
        return cls(_excite.Plant.from_text(text, toml, name), ("text", text, toml, name))

    @classmethod
    def from_mjcf(cls, mjcf: PathLike) -> "Robot":
        """Read a MuJoCo model (MJCF): its path, or its text, which then includes no other file."""
        text = os.fspath(mjcf)
        if "<" in text:
            return cls._from_files({"model.xml": text}, "model.xml")
        return cls.load(text)

    @classmethod
    def _from_files(cls, files: Dict[str, str], first: str) -> "Robot":
        """From the texts of files that refer to one another."""
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files.items():
                Path(folder, name).write_text(text, encoding="utf-8")
            try:
                plant = _excite.Plant.load(str(Path(folder, first)))
            except _excite.Error as e:
                error = _excite.Error(str(e).replace(folder + os.sep, ""))
                error.kind = e.kind
                raise error from None
        return cls(plant, ("files", files, first))

    def _changed(self, method: str, *args: Any) -> "Robot":
        plant = getattr(self._plant, method)(*args)
        return Robot(plant, self._source, (*self._changes, (method, args)))

    def with_terms(self, terms: Sequence[str]) -> "Robot":
        """The same robot with other joint columns, for all joints: of armature, viscous, coulomb, offset."""
        return self._changed("with_terms", _names("terms", terms))

    def in_space(self, coordinates: Optional[str]) -> "Robot":
        """The same parallel robot moved by its ``"platform"`` or by its ``"actuators"``."""
        return self._changed("in_space", coordinates)

    def without_collisions(self) -> "Robot":
        """The same robot of which no collisions are looked at."""
        return self._changed("without_collisions")

    def with_meshes(self, folders: Sequence[PathLike]) -> "Robot":
        """The same robot whose ``package://`` meshes are looked for in these folders first."""
        return self._changed("with_meshes", [os.fspath(f) for f in folders])

    def __reduce__(self) -> Tuple[Callable[..., "Robot"], Tuple[Any, ...]]:
        return _again, (self._source, self._changes)

    def __repr__(self) -> str:
        return f"<excite.Robot {self.name}: {', '.join(self.joints)}>"

    def _named(self) -> str:
        """The robot as an ``experiment.toml`` names it."""
        return str(self._source[1]) if self._source[0] == "load" else "robot.toml"

    def _texts(self) -> Dict[str, str]:
        """Files that such an entry needs beside it; none where it names a file or a bundled robot."""
        if self._source[0] == "load":
            return {}
        if self._source[0] == "files":
            return dict(self._source[1])
        _, urdf, toml, _ = self._source
        text = toml if toml is not None else 'urdf = "robot.urdf"\n'
        return {"robot.urdf": urdf, "robot.toml": text}

    @property
    def name(self) -> str:
        """Its name."""
        return str(self._card["name"])

    @property
    def joints(self) -> List[str]:
        """Names of the actuated joints, in the order of all arrays."""
        return [j["name"] for j in self._card["joints"]]

    @property
    def coordinates(self) -> List[str]:
        """Names of what a trajectory moves: the joints, or the coordinates of a platform."""
        return [j["name"] for j in self._card["coordinates"]]

    @property
    def limits(self) -> Dict[str, Dict[str, Any]]:
        """Limits of the coordinates by name: ``position`` (lower, upper), ``velocity``, ``acceleration``, ``jerk``,
        ``effort``; rad or m and seconds, N m or N; ``None`` where none is stated."""
        return {j["name"]: j["limits"] for j in self._card["coordinates"]}

    @property
    def tree(self) -> Optional[List[str]]:
        """Names of all joints of a parallel robot, in the order of its robot files; ``None`` of others."""
        names: Optional[List[str]] = self._card["tree"] if self.closed else None
        return names

    @property
    def closed(self) -> bool:
        """Whether it is a parallel robot."""
        return bool(self._card["closed"])

    @property
    def gravity(self) -> Array:
        """Acceleration of gravity in the base frame, m/s², ``(3,)``."""
        return np.array(self._card["gravity"])

    @property
    def parameters(self) -> List[Parameter]:
        """The parameters, in the order of the columns of :meth:`regressor`."""
        return [Parameter(p["name"], p["unit"], p["value"]) for p in self._card["parameters"]]

    @property
    def values(self) -> Array:
        """Values of the parameters in the robot file, ``(p,)``."""
        return np.array([p["value"] for p in self._card["parameters"]])

    @property
    def warnings(self) -> List[Notice]:
        """What was imperfect in its files."""
        return notices(self._plant.warnings())

    def _motion(self, q: Any, dq: Any, ddq: Any) -> Tuple[Array, Array, Array]:
        names = self.coordinates
        what = ", ".join(names)
        q = finite("q", rows("q", q, len(names), what))
        zero = np.zeros(q.shape, order="F")
        dq = zero if dq is None else finite("dq", rows("dq", dq, len(names), what))
        ddq = zero if ddq is None else finite("ddq", rows("ddq", ddq, len(names), what))
        if dq.shape != q.shape or ddq.shape != q.shape:
            raise unusable(f"q, dq and ddq differ in shape: {q.shape}, {dq.shape}, {ddq.shape}")
        return by_column(q), by_column(dq), by_column(ddq)

    def regressor(self, q: Any, dq: Any = None, ddq: Any = None) -> Array:
        """Regressor ``Y`` of many states at once: ``tau = Y @ phi`` with ``phi`` as :attr:`parameters`.

        ``q``, ``dq``, ``ddq``: positions, velocities, accelerations of the coordinates, rad or m and seconds,
        ``(samples, coordinates)``, or ``(coordinates,)`` for one state; 0 where left out. Gives
        ``(samples, joints, p)``. The result is not copied; it lies in memory column by column, ``Y[:, j, c]`` in one
        piece. Columns are of what the robot file lists under ``identify``; see :meth:`with_terms`.
        """
        motion = self._motion(q, dq, ddq)
        flat = self._plant.regressor(*motion)
        joints = len(self._card["joints"])
        count = len(motion[0]) // max(len(self._card["coordinates"]), 1)
        array: Array = flat.reshape(len(self._card["parameters"]), joints, count).transpose(2, 1, 0)
        return array

    def torque(self, q: Any, dq: Any = None, ddq: Any = None, parameters: Any = None) -> Array:
        """Inverse dynamics of many states at once, N m or N, ``(samples, joints)``.

        States as for :meth:`regressor`. Of the nominal model with all its terms, or with other values of the
        parameters, ``(p,)``.
        """
        motion = self._motion(q, dq, ddq)
        phi = None
        if parameters is not None:
            phi = vector("parameters", parameters, len(self._card["parameters"])).tolist()
        flat = self._plant.torque(*motion, phi)
        return from_columns(flat, len(self._card["joints"]))

    def base(self) -> BaseParameters:
        """The base parameters: what can be told from actuator torques at all."""
        raw = json.loads(self._plant.base())
        kept, dropped = raw["kept"], raw["dropped"]
        k = np.array(raw["k"], dtype=np.float64).reshape(len(kept), len(dropped))
        names = [raw["names"][i] for i in kept]
        return BaseParameters(names, raw["combinations"], np.array(raw["values"]), kept, dropped, k)

    def random_states(self, count: int, seed: int = 0) -> Tuple[Array, Array, Array]:
        """Random positions, velocities and accelerations inside the limits, each ``(count, coordinates)``."""
        flat = self._plant.random_states(count, seed)
        width = len(self._card["coordinates"])
        q, dq, ddq = (from_columns(f, width) for f in flat)
        return q, dq, ddq


def _names(what: str, names: Sequence[str]) -> List[str]:
    """Names as a list; one name alone is meant as one."""
    all_names = [names] if isinstance(names, str) else list(names)
    if not all(isinstance(n, str) for n in all_names):
        raise unusable(f"{what} must be names, not {names!r}")
    return all_names


def _again(source: Tuple[Any, ...], changes: Tuple[Any, ...]) -> Robot:
    """A robot that was pickled."""
    kind, *args = source
    made = {"load": Robot.load, "text": Robot.from_urdf, "files": Robot._from_files}[kind]
    robot = made(*args[:-1], name=args[-1]) if kind == "text" else made(*args)  # type: ignore[operator]
    for method, method_args in changes:
        robot = robot._changed(method, *method_args)
    return robot  # type: ignore[no-any-return]
