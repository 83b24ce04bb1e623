"""What the functions give: numbers as attributes, the report for a notebook, files."""

from __future__ import annotations

import html as _html
import json
import os
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from . import _excite, _posterior
from ._arrays import Array, floats, pandas
from ._errors import Notice, emit, notices, unusable
from ._robot import PathLike, Robot
from ._trajectory import Trajectory


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
        return floats(p["value"] for p in self._model["parameters"])

    @property
    def std(self) -> Array:
        """Their standard deviations: data and prior, ``(p,)``."""
        return floats(p["std"] for p in self._model["parameters"])

    @property
    def base_names(self) -> List[str]:
        """Base parameters in words, ``b`` of them."""
        return [p["combination"] for p in self._model["base_parameters"]]

    @property
    def base_values(self) -> Array:
        """Their values, ``(b,)``."""
        return floats(p["value"] for p in self._model["base_parameters"])

    @property
    def base_covariance(self) -> Array:
        """Covariance of the base parameters, ``(b, b)``."""
        return np.array([floats(row) for row in self._model["base_covariance"]])

    def sample(self, n: int, seed: int = 0) -> _posterior.Posterior:
        """``n`` robots that the data do not exclude, for what you randomise; all of them can exist."""
        if int(n) != n or n < 1 or int(seed) != seed or seed < 0:
            raise unusable(f"n and seed are whole numbers, n at least 1: not {n!r}, {seed!r}")
        return _posterior.sample(self.robot, self._model, self._value, int(n), int(seed))

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
        return floats(self._value["com"]["value"])

    @property
    def inertia(self) -> Array:
        """Inertia about the centre of mass, kg m², ``(3, 3)``; NaN where it is not known."""
        xx, xy, xz, yy, yz, zz = floats(self._value["inertia_com"]["value"])
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    @property
    def std(self) -> Dict[str, Array]:
        """Standard deviations: ``mass``, ``com``, and ``inertia`` in the order xx, xy, xz, yy, yz, zz."""
        v = self._value
        mass = np.array(_float(v["mass"]["std"]))
        return {"mass": mass, "com": floats(v["com"]["std"]), "inertia": floats(v["inertia_com"]["std"])}

    def to_frame(self) -> Any:
        """The ten parameters as a pandas ``DataFrame``."""
        v, s = self._value, self.std
        names = ["mass", "com x", "com y", "com z", "xx", "xy", "xz", "yy", "yz", "zz"]
        values = [self.mass, *self.com, *floats(v["inertia_com"]["value"])]
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
    _may: Tuple[str, ...] = ("robot.urdf", "robot.xml", "robot.toml", "effects.py", "next.json", "samples.csv")
    _rows = "findings"

    @classmethod
    def read(cls, folder: PathLike) -> "Diagnosis":
        """Read the folder that ``excite diagnose`` or :meth:`save` wrote."""
        folder = Path(os.fspath(folder))
        self = cls.__new__(cls)
        try:
            self._json = (folder / cls._file).read_text(encoding="utf-8")
            self._value = json.loads(self._json)
            self._page = (folder / "report.html").read_text(encoding="utf-8")
            there = [name for name in cls._may if (folder / name).is_file()]
            # those of this diagnosis, and none that an earlier one left
            count = self._value["samples"]["count"] if "samples" in self._value else 0
            own = [_posterior.folder_of(k) for k in range(count)]
            there += [f"{k}/{name}" for k in own for name in cls._may if (folder / k / name).is_file()]
            self._files = {name: (folder / name).read_text(encoding="utf-8") for name in there}
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
        robot = self._robot_of_files()
        if robot.joints != self._value["joints"]:
            # of a parallel robot the URDF alone is its open tree
            raise unusable("no robot file could be written that closes the loops; see .warnings")
        return robot

    @property
    def samples(self) -> Optional[_posterior.Diagnosed]:
        """Robots that the records do not exclude, where ``samples`` asked for some."""
        about = self._value.get("samples")
        return None if about is None else _posterior.Diagnosed(about, self._files)

    @property
    def next(self) -> Optional[Trajectory]:
        """The motion to run next, where there is one that tells more."""
        text = self._files.get("next.json")
        return None if text is None else Trajectory(text)

    def __repr__(self) -> str:
        named = ", ".join(f"{c['effect']} ({', '.join(c['joints']) or 'whole robot'})" for c in self.claims)
        return f"<excite.Diagnosis of {self._value.get('robot', '')}: {self.verdict}{': ' + named if named else ''}>"


class PoseDiagnosis(Diagnosis):
    """Why the geometry of a robot and what was seen of its tool disagree; of a ``calibration.toml``."""

    _may: Tuple[str, ...] = ("next.csv",)

    @property
    def holdout_shrink(self) -> float:
        """Share of the gap on rows held out that is gone with all findings; NaN without such rows."""
        return _float(self._value["holdout_shrink"])

    @property
    def outliers(self) -> List[int]:
        """Rows that do not belong, from 0 through all files."""
        return [int(i) for i in self._value["outliers"]]

    @property
    def robot(self) -> Robot:
        """None is written: :func:`calibrate` does that."""
        raise unusable("a diagnosis of poses writes no robot; excite.calibrate does")

    @property
    def next(self) -> Optional[Trajectory]:
        """None: it is postures that tell more, see :attr:`postures`."""
        return None

    @property
    def postures(self) -> Optional[Dict[str, Array]]:
        """Postures to measure next, where there are some that tell more: ``q`` (rad or m, ``(rows, joints)``) and, where the
        side matters, ``approach`` (1: come from below, −1: from above)."""
        text = self._files.get("next.csv")
        if text is None:
            return None
        names, *lines = text.splitlines()
        table = np.array([[float(c) for c in line.split(",")] for line in lines])
        of = [n.rstrip("0123456789") for n in names.split(",")]
        return {k: table[:, [i for i, n in enumerate(of) if n == k]] for k in ("q", "approach") if k in of}

    def __repr__(self) -> str:
        named = ", ".join(f"{c['effect']} ({' or '.join(c['places'])})" for c in self.claims)
        return f"<excite.PoseDiagnosis of {self._value.get('robot', '')}: {self.verdict}{': ' + named if named else ''}>"


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


def _float(x: Optional[float]) -> float:
    return float("nan") if x is None else float(x)


__all__ = ["Calibration", "Diagnosis", "Identification", "Load", "PoseDiagnosis", "Result"]
