"""What the functions give: numbers as attributes, the report for a notebook, files."""

from __future__ import annotations

import html as _html
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Tuple

import numpy as np

from . import _excite
from ._arrays import Array, columns, from_columns, pandas
from ._errors import Notice, emit, notices, unusable
from ._records import Payload, Record
from ._robot import PathLike, Robot
from ._trajectory import Motion, Trajectory

if TYPE_CHECKING:
    from ._posterior import Posterior


def frame_html(page: str, height: int = 720) -> str:
    """A page in a frame of its own, for a notebook."""
    return (
        f'<iframe style="width:100%;height:{height}px;border:1px solid #ccc" '
        f'srcdoc="{_html.escape(page, quote=True)}"></iframe>'
    )


class Result:
    """The result of a function: attributes, :meth:`to_dict`, :meth:`to_frame`, :meth:`save`, a report in notebooks.

    It can be pickled.
    """

    #: name of the JSON file that the program writes
    _file = "report.json"
    #: names that a run may write, or not
    _may: Tuple[str, ...] = ()
    #: the list in the JSON that makes the frame
    _rows = "parameters"

    def __init__(self, report: _excite.Report) -> None:
        self._report: Optional[_excite.Report] = report
        self._json = report.json
        self._files: Dict[str, str] = dict(report.files)
        self._page: Optional[str] = None
        self._value: Dict[str, Any] = json.loads(self._json)
        #: everything imperfect
        self.warnings: List[Notice] = notices(report.warnings)

    def to_dict(self) -> Dict[str, Any]:
        """What the program writes as JSON."""
        value: Dict[str, Any] = json.loads(self._json)
        return value

    def to_json(self) -> str:
        """The text of the JSON that the program writes."""
        return self._json

    def to_frame(self) -> Any:
        """The table of the result as a pandas ``DataFrame``."""
        return pandas().DataFrame(self._value[self._rows])

    @property
    def html(self) -> str:
        """The report, a page that needs nothing else."""
        if self._page is None:
            assert self._report is not None
            self._page = self._report.html()
        return self._page

    @property
    def files(self) -> Dict[str, str]:
        """Texts of the files that go with it, by name."""
        return dict(self._files)

    def _texts(self) -> Dict[str, str]:
        return {self._file: self._json, "report.html": self.html, **self._files}

    def save(self, folder: PathLike, *, force: bool = False) -> List[Path]:
        """Write what the program writes into a folder; nothing there is replaced without ``force``."""
        texts = self._texts()
        absent = [n for n in self._may if n not in texts]
        files = [(name, text.encode()) for name, text in texts.items()]
        return _excite.save(Path(os.fspath(folder)), files, absent, force)

    def _repr_html_(self) -> str:
        return frame_html(self.html)

    def __getstate__(self) -> Dict[str, Any]:
        return {**self.__dict__, "_page": self.html, "_report": None}

    def __repr__(self) -> str:
        return f"<excite.{type(self).__name__} of {self._value.get('robot', '')}>"

    def _robot_of_files(self) -> Robot:
        texts = {n: t for n, t in self._files.items() if n.startswith("robot.")}
        for first in ("robot.toml", "robot.urdf"):
            if first in texts:
                return Robot._from_files(texts, first)
        raise unusable("no robot file could be written; see .warnings")


class _Model(Result):
    """A result that is a model of the robot."""

    def into(self, scene: PathLike, folder: PathLike, *, force: bool = False) -> Dict[str, Any]:
        """Write a copy of your own MJCF or URDF with the model in it into a folder (``--into``).

        Only what differs from the model is changed; comments, order, meshes and all else stay. Gives ``file``, and
        ``changes``: ``file``, ``line``, ``element``, ``attribute``, ``old``, ``new``; ``left_out`` names what the format
        has no place for. A result that was pickled or read from a folder has no model to write.
        """
        if self._report is None:
            raise unusable("this result was read or copied; call the function again to write its model into a scene")
        scene, folder = Path(os.fspath(scene)), Path(os.fspath(folder))
        files, text, warnings = self._report.edited_scene(scene, folder)
        _excite.save(folder, [(name, content.encode()) for name, content in files], [], force)
        value: Dict[str, Any] = json.loads(text)
        emit(notices(warnings))
        return value


class Assessment(Result):
    """What a robot can tell, and how well a trajectory tells it."""

    _rows = "relative_std"

    @property
    def base_parameters(self) -> int:
        """How many combinations of parameters can be identified."""
        return int(self._value["base_parameters"])

    @property
    def condition_number(self) -> Optional[Dict[str, float]]:
        """``invariant``, ``raw``, ``normalised``, ``weighted``; ``None`` without a trajectory."""
        value: Optional[Dict[str, float]] = self._value.get("condition_number")
        return value

    @property
    def limits(self) -> Optional[Dict[str, Any]]:
        """Whether all limits hold for all time, and which one is closest."""
        value: Optional[Dict[str, Any]] = self._value.get("limits")
        return value

    @property
    def satisfied(self) -> Optional[bool]:
        """Whether all limits hold for all time; ``None`` without a trajectory."""
        limits = self.limits
        return None if limits is None else bool(limits["satisfied"])

    @property
    def clearance(self) -> Optional[Dict[str, Any]]:
        """How near the motion brings the robot to itself and to what stands around, m; ``None`` where it was not looked
        at."""
        value: Optional[Dict[str, Any]] = self._value.get("clearance")
        return value


class Design(Assessment):
    """A designed trajectory with its report."""

    def __init__(
        self,
        report: _excite.Report,
        robot: Robot,
        trajectory: Trajectory,
        motions: List[Motion],
        experiment: str,
        rate: float,
    ) -> None:
        super().__init__(report)
        #: the robot
        self.robot = robot
        #: the trajectory, inside all limits for all time
        self.trajectory = trajectory
        #: the further motions of ``diagnostic=True``
        self.motions = motions
        self._experiment = experiment
        self._rate = rate

    @property
    def status(self) -> str:
        """How it ended: ``"converged"``, ``"time_limit"`` or ``"interrupted"``."""
        return str(self._value["status"])

    def save(self, folder: PathLike, *, force: bool = False) -> List[Path]:
        """Write ``trajectory.json``, ``samples.csv``, ``report.json`` and ``report.html``; with ``diagnostic=True`` the
        other motions and an ``experiment.toml`` that waits for their logs."""
        folder = Path(os.fspath(folder))
        motions = [("trajectory", "samples", self.trajectory)]
        motions += [(m.name, m.name, m.trajectory) for m in self.motions]
        texts = {f"{name}.json": t.to_json() for name, _, t in motions}
        texts.update(self._texts())
        if self._experiment:
            texts["experiment.toml"] = self._experiment
            texts.update(self.robot._texts())
        tables = [f"{table}.csv" for _, table, _ in motions]
        for name in tables:
            if not force and (folder / name).exists():
                # the text of a file that is in the way
                _excite.save(folder, [(name, b"")], [], False)
        paths = _excite.save(folder, [(n, t.encode()) for n, t in texts.items()], [], force)
        for table, (_, _, t) in zip(tables, motions):
            _excite.write_samples(self.robot._plant, t.to_json(), folder / table, self._rate, force)
            paths.append(folder / table)
        return paths


class Simulation:
    """A rehearsal: the log of a simulated robot, and what really happened.

    It has the channels of a log as attributes, ``(samples, joints)``: ``t`` (s), ``q`` (measured, rad or m), ``tau``
    (measured, N m or N), ``qref`` (commanded), and without any sensor ``true_q``, ``dq``, ``ddq``, ``true_tau``.
    ``pose`` is that of the platform, ``(samples, 7)``, where it was asked for.
    """

    def __init__(self, raw: Dict[str, Any], robot: str, joints: List[str], derivatives: bool, payload: Payload) -> None:
        width = len(joints)
        #: name of the robot
        self.robot = robot
        #: names of the joints
        self.joints = joints
        self.t: Array = raw["t"]
        self.q: Array = from_columns(raw["q"], width)
        self.tau: Array = from_columns(raw["tau"], width)
        self.qref: Array = from_columns(raw["qref"], width)
        self.true_q: Array = from_columns(raw["true_q"], width)
        self.dq: Array = from_columns(raw["dq"], width)
        self.ddq: Array = from_columns(raw["ddq"], width)
        self.true_tau: Array = from_columns(raw["true_tau"], width)
        self.pose: Optional[Array] = np.column_stack(raw["pose"]) if raw["pose"] else None
        #: predicted against achieved spread of the base parameters, where ``monte_carlo`` was asked for
        self.monte_carlo: Optional[Dict[str, Any]] = json.loads(raw["monte_carlo"]) if raw["monte_carlo"] else None
        #: everything imperfect
        self.warnings: List[Notice] = notices(raw["warnings"])
        #: period of the motion, s
        self.period: float = raw["period"]
        #: how many of them
        self.periods: int = raw["periods"]
        self._derivatives = derivatives
        self._payload = payload

    def record(self, use: str = "fit", **settings: Any) -> Record:
        """The log as a record; a payload that was simulated is unknown to it."""
        own: Dict[str, Any] = {"use": use, "payload": self._payload, "name": "simulated"}
        if self.periods > 1:
            own["period"] = self.period
        if self._derivatives:
            own.update(dq=self.dq, ddq=self.ddq)
        if self.pose is not None:
            own["pose"] = self.pose
        return Record(self.t, self.q, self.tau, qref=self.qref, **{**own, **settings})

    def _table(self) -> Tuple[List[str], List[Array]]:
        names, data = ["t"], [self.t]
        channels = [("q", self.q), ("tau", self.tau), ("qref", self.qref)]
        if self._derivatives:
            channels += [("dq", self.dq), ("ddq", self.ddq)]
        for channel, array in channels:
            names += [f"{channel}{k + 1}" for k in range(array.shape[1])]
            data += columns(array)
        if self.pose is not None:
            names += ["x", "y", "z", "qw", "qx", "qy", "qz"]
            data += columns(self.pose)
        return names, data

    def to_dict(self) -> Dict[str, List[float]]:
        """The columns of the log by their names."""
        names, data = self._table()
        return {n: c.tolist() for n, c in zip(names, data)}

    def to_frame(self) -> Any:
        """The log as a pandas ``DataFrame``."""
        names, data = self._table()
        return pandas().DataFrame(dict(zip(names, data)))

    def to_csv(self, path: PathLike, *, force: bool = False) -> Path:
        """Write the log that the program writes."""
        path = Path(os.fspath(path))
        names, data = self._table()
        text = _excite.table(names, [np.ascontiguousarray(c) for c in data])
        return _excite.save(path.parent, [(path.name, text.encode())], [], force)[0]

    def save(self, folder: PathLike, *, force: bool = False) -> List[Path]:
        """Write ``log.csv`` into a folder."""
        return [self.to_csv(Path(os.fspath(folder), "log.csv"), force=force)]

    def __repr__(self) -> str:
        return f"<excite.Simulation of {self.robot}: {len(self.t)} samples, {self.periods} x {self.period} s>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{_html.escape(name)}</td><td>{self.q[:, j].min():.4g} … {self.q[:, j].max():.4g}</td>"
            f"<td>{np.abs(self.tau[:, j]).max():.4g}</td></tr>"
            for j, name in enumerate(self.joints)
        )
        head = "<tr><th>joint</th><th>position, rad or m</th><th>largest torque, N m or N</th></tr>"
        return f"<p>{_html.escape(repr(self)[1:-1])}</p><table>{head}{rows}</table>"


class Identification(_Model):
    """An identified model."""

    _may = ("robot.urdf", "robot.xml", "robot.toml", "effects.py")

    def __init__(self, report: _excite.Report) -> None:
        super().__init__(report)
        self._model: Dict[str, Any] = json.loads(self._files["model.json"])
        self._own: Optional[Robot] = None

    @property
    def robot(self) -> Robot:
        """The identified robot, for every other function."""
        if self._own is None:
            self._own = self._robot_of_files()
        return self._own

    @property
    def model(self) -> Dict[str, Any]:
        """What ``model.json`` holds."""
        value: Dict[str, Any] = json.loads(self._files["model.json"])
        return value

    @property
    def names(self) -> List[str]:
        """Names of the parameters."""
        return [p["name"] for p in self._model["parameters"]]

    @property
    def values(self) -> Array:
        """Identified values of the parameters, those of a robot that can exist, ``(p,)``."""
        return _floats(p["value"] for p in self._model["parameters"])

    @property
    def std(self) -> Array:
        """Their standard deviations: data and prior, ``(p,)``."""
        return _floats(p["std"] for p in self._model["parameters"])

    @property
    def base_names(self) -> List[str]:
        """Base parameters in words, ``b`` of them."""
        return [p["combination"] for p in self._model["base_parameters"]]

    @property
    def base_values(self) -> Array:
        """Their values, ``(b,)``."""
        return _floats(p["value"] for p in self._model["base_parameters"])

    @property
    def base_covariance(self) -> Array:
        """Covariance of the base parameters, ``(b, b)``."""
        return np.array([_floats(row) for row in self._model["base_covariance"]])

    def sample(self, n: int, seed: int = 0) -> "Posterior":
        """``n`` robots that the data do not exclude, for what you randomise; all of them can exist."""
        from ._posterior import sample

        if int(n) != n or n < 1 or int(seed) != seed or seed < 0:
            raise unusable(f"n and seed are whole numbers, n at least 1: not {n!r}, {seed!r}")
        return sample(self, int(n), int(seed))

    @property
    def validation(self) -> Dict[str, Any]:
        """Errors of the torque on ``fit`` and ``holdout`` records, whole and joint by joint."""
        value: Dict[str, Any] = self._value["validation"]
        return value

    @property
    def physically_consistent(self) -> bool:
        """Whether every body can exist and no friction or armature is negative."""
        return bool(self._value["physically_consistent"])

    @property
    def verdict(self) -> str:
        """The result in one sentence."""
        return str(self._value["verdict"])

    def __getstate__(self) -> Dict[str, Any]:
        return {**super().__getstate__(), "_own": None}

    def __repr__(self) -> str:
        return f"<excite.Identification of {self._value['robot']}: {self.verdict}>"


class Load(Result):
    """The load that a robot carries."""

    _file = "load.json"

    def __init__(self, report: _excite.Report, controllers: List[str]) -> None:
        super().__init__(report)
        self._for = controllers

    @property
    def mass(self) -> float:
        """kg."""
        return _float(self._value["mass"]["value"])

    @property
    def com(self) -> Array:
        """Centre of mass in the frame of the body that carries it, m, ``(3,)``; NaN where it is not known."""
        return _floats(self._value["com"]["value"])

    @property
    def inertia(self) -> Array:
        """Inertia about the centre of mass, kg m², ``(3, 3)``; NaN where it is not known."""
        xx, xy, xz, yy, yz, zz = _floats(self._value["inertia_com"]["value"])
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    @property
    def std(self) -> Dict[str, Array]:
        """Standard deviations: ``mass``, ``com``, and ``inertia`` in the order xx, xy, xz, yy, yz, zz."""
        v = self._value
        mass = np.array(_float(v["mass"]["std"]))
        return {"mass": mass, "com": _floats(v["com"]["std"]), "inertia": _floats(v["inertia_com"]["std"])}

    def to_frame(self) -> Any:
        """The ten parameters as a pandas ``DataFrame``."""
        v, s = self._value, self.std
        names = ["mass", "com x", "com y", "com z", "xx", "xy", "xz", "yy", "yz", "zz"]
        values = [self.mass, *self.com, *_floats(v["inertia_com"]["value"])]
        units = ["kg"] + ["m"] * 3 + ["kg m²"] * 6
        std = [float(s["mass"]), *s["com"], *s["inertia"]]
        return pandas().DataFrame({"parameter": names, "value": values, "std": std, "unit": units})

    def _texts(self) -> Dict[str, str]:
        texts = {self._file: self._json, "report.html": self.html}
        for name in self._for:
            file = CONTROLLERS[name]
            if file not in self._files:
                raise unusable(f"{name}: its controller cannot hold this load")
            texts[file] = self._files[file]
        return texts

    def __repr__(self) -> str:
        return f"<excite.Load on {self._value['frame']} of {self._value['robot']}: {self.mass:.4g} kg>"


#: Files of controllers that hold a load.
CONTROLLERS = {
    "franka": "endeffector-config.json",
    "ur": "set_target_payload.script",
    "kuka": "load_data.dat",
}


class Diagnosis(_Model):
    """Why a model and its robot disagree."""

    _file = "diagnosis.json"
    _may = ("robot.urdf", "robot.xml", "robot.toml", "effects.py", "next.json")
    _rows = "findings"

    @classmethod
    def read(cls, folder: PathLike) -> "Diagnosis":
        """Read the folder that ``excite diagnose`` or :meth:`save` wrote."""
        folder = Path(os.fspath(folder))
        self = cls.__new__(cls)
        try:
            self._json = (folder / cls._file).read_text(encoding="utf-8")
            self._page = (folder / "report.html").read_text(encoding="utf-8")
            there = [name for name in cls._may if (folder / name).is_file()]
            self._files = {name: (folder / name).read_text(encoding="utf-8") for name in there}
            self._value = json.loads(self._json)
            self.warnings = [Notice(w["kind"], w["subject"], w["message"]) for w in self._value["warnings"]]
        except (OSError, ValueError, KeyError, TypeError) as e:
            raise unusable(f"{folder} is no folder of a diagnosis: {e}") from None
        self._report = None
        return self

    @property
    def verdict(self) -> str:
        """``"no_gap"``, ``"explained"``, ``"partly_explained"`` or ``"unknown"``."""
        return str(self._value["verdict"])

    @property
    def gap(self) -> Dict[str, Any]:
        """Where the gap lies: its size, the noise, joint by joint."""
        value: Dict[str, Any] = self._value["gap"]
        return value

    @property
    def findings(self) -> List[Dict[str, Any]]:
        """Effects by falling confidence; one of at least 0.5 is a claim."""
        value: List[Dict[str, Any]] = self._value["findings"]
        return value

    @property
    def claims(self) -> List[Dict[str, Any]]:
        """The effects that are claimed."""
        return [f for f in self.findings if f["confidence"] >= 0.5]

    @property
    def unexplained(self) -> float:
        """Share of the gap that stays."""
        return _float(self._value["unexplained"])

    @property
    def robot(self) -> Robot:
        """The improved robot, for every other function."""
        return self._robot_of_files()

    @property
    def next(self) -> Optional[Trajectory]:
        """The motion to run next, where there is one that tells more."""
        text = self._files.get("next.json")
        return None if text is None else Trajectory(text)

    def __repr__(self) -> str:
        named = ", ".join(f"{c['effect']} ({', '.join(c['joints']) or 'whole robot'})" for c in self.claims)
        return f"<excite.Diagnosis of {self._value.get('robot', '')}: {self.verdict}{': ' + named if named else ''}>"


class Calibration(Result):
    """A calibrated robot."""

    _file = "calibration.json"
    _may = ("robot.urdf", "robot.toml")

    @property
    def robot(self) -> Robot:
        """The robot with the calibrated geometry."""
        return self._robot_of_files()

    @property
    def identifiable(self) -> int:
        """How many unknowns can be told apart."""
        return int(self._value["identifiable"])

    @property
    def fit(self) -> Optional[Dict[str, Any]]:
        """Errors ``before`` and ``after`` of the rows that were fitted, m."""
        value: Optional[Dict[str, Any]] = self._value["fit"]
        return value

    @property
    def holdout(self) -> Optional[Dict[str, Any]]:
        """Errors ``before`` and ``after`` of the rows that took no part, m; ``None`` without such rows."""
        value: Optional[Dict[str, Any]] = self._value["holdout"]
        return value


class Export:
    """A trajectory in a file that a controller reads."""

    def __init__(self, raw: Dict[str, Any]) -> None:
        #: name of the format
        self.format: str = raw["name"]
        #: the file
        self.data: bytes = raw["data"]
        #: what is put behind the name of a second file, and its text; ``None`` where there is none
        self.beside: Optional[Tuple[str, str]] = raw["beside"]
        #: what will run, and how far the controller may leave the motion between two points
        self.summary: str = raw["summary"]
        #: extension of the file
        self.extension: str = raw["extension"]
        #: everything imperfect
        self.warnings: List[Notice] = notices(raw["warnings"])

    @property
    def text(self) -> str:
        """The file as text; formats of bytes have none."""
        try:
            return self.data.decode()
        except UnicodeDecodeError:
            raise unusable(f"{self.format} is a format of bytes: see .data") from None

    def to_dict(self) -> Dict[str, Any]:
        """What is said of it."""
        return {"format": self.format, "bytes": len(self.data), "summary": self.summary}

    def save(self, path: PathLike, *, force: bool = False) -> List[Path]:
        """Write the file, and the second one beside it where there is one."""
        path = Path(os.fspath(path))
        files = [(path.name, self.data)]
        if self.beside is not None:
            files.append((path.stem + self.beside[0], self.beside[1].encode()))
        return _excite.save(path.parent, files, [], force)

    def __repr__(self) -> str:
        return f"<excite.Export {self.format}: {len(self.data)} bytes>"


def _float(x: Optional[float]) -> float:
    return float("nan") if x is None else float(x)


def _floats(values: Any) -> Array:
    return np.array([_float(x) for x in values], dtype=np.float64)


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a design; the best trajectory so far is kept."""

    best: Optional[Design]
    """the design with the best trajectory that was found until then"""

    def __init__(self, best: Optional[Design] = None) -> None:
        super().__init__("interrupted; the best trajectory so far is in .best")
        self.best = best


__all__ = [
    "Assessment",
    "Calibration",
    "Design",
    "Diagnosis",
    "Export",
    "Identification",
    "Interrupted",
    "Load",
    "Result",
    "Simulation",
]
