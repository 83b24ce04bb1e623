"""What is designed, assessed, simulated and exported: results with motions and arrays."""

from __future__ import annotations

import html as _html
import json
import os
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from . import _excite
from ._arrays import Array, columns, from_columns, pandas
from ._errors import Notice, notices, unusable
from ._records import Payload, Record
from ._results import Result
from ._robot import PathLike, Robot
from ._trajectory import Motion, Trajectory


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


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a design; the best trajectory so far is kept."""

    best: Optional[Design]
    """the design with the best trajectory that was found until then"""

    def __init__(self, best: Optional[Design] = None) -> None:
        super().__init__("interrupted; the best trajectory so far is in .best")
        self.best = best


__all__ = ["Assessment", "Design", "Export", "Interrupted", "Simulation"]
