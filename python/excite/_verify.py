"""The proof in a simulator: how far the gap shrinks there."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _excite
from ._arrays import Array, from_columns, numbers, pandas
from ._command import Command, Feedback, mass, stiff
from ._errors import Notice, emit, unusable
from ._mujoco import Model
from ._progress import Bar, Progress
from ._records import Experiment, as_experiment
from ._results import Diagnosis, frame_html
from ._robot import PathLike, Robot

#: A simulator of a user: positions ``(steps + 1, joints)`` from the state at the start, a command and the time between
#: the rows.
Simulator = Callable[[Array, Array, Command, float], Any]

#: Time before a run in which a model with a memory follows the record, s, and the frequency that holds it, Hz.
BEFORE, HOLD = 0.5, 20.0
#: A deviation that is smaller is that of no model, rad or m.
TINY = 1e-7
#: A gap of the torques that is smaller than so many standard deviations of the energy of white noise has no share. Noise is
#: not white, and what is left of it in a band of a tenth of all frequencies scatters three times as much.
CLEAR = 10.0


class _Run(NamedTuple):
    """A part of a record."""

    record: str
    start: float
    t: Array
    log: Array
    deviation: List[Array]


class Verification:
    """How far the gap shrinks in a simulator, beside what was claimed."""

    def __init__(self, value: Dict[str, Any], page: str, warnings: List[Notice]) -> None:
        self._value = value
        self._page = page
        #: everything imperfect
        self.warnings = warnings

    @property
    def claimed(self) -> Optional[float]:
        """Share of the energy of the torque gap on holdout that the diagnosis claims gone."""
        value: Optional[float] = self._value["torque"]["claimed"]
        return value

    @property
    def shrink(self) -> Optional[float]:
        """The same as the simulator shows it by inverse dynamics; ``None`` where it has none, or there was no gap."""
        value: Optional[float] = self._value["torque"]["measured"]
        return value

    @property
    def horizons(self) -> List[Dict[str, Any]]:
        """Deviation from the log by horizon: ``seconds``, ``runs``, ``shrink``, and joint by joint ``rms`` and
        ``shrink``."""
        value: List[Dict[str, Any]] = self._value["horizons"]
        return value

    @property
    def html(self) -> str:
        """The report, a page that needs nothing else."""
        return self._page

    def to_dict(self) -> Dict[str, Any]:
        """All figures."""
        value: Dict[str, Any] = json.loads(json.dumps(self._value))
        return value

    def to_frame(self) -> Any:
        """Horizon by joint as a pandas ``DataFrame``."""
        rows = [{"seconds": h["seconds"], **j} for h in self.horizons for j in h["joints"]]
        return pandas().DataFrame(rows)

    def save(self, folder: PathLike, *, force: bool = False) -> List[Path]:
        """Write ``verification.json`` and ``report.html`` into a folder."""
        text = json.dumps(self._value, indent=2) + "\n"
        files = [("verification.json", text.encode()), ("report.html", self._page.encode())]
        return _excite.save(Path(os.fspath(folder)), files, [], force)

    def _repr_html_(self) -> str:
        return frame_html(self._page)

    def __repr__(self) -> str:
        return f"<excite.Verification: {self._value['sentence']}>"


def verify(
    experiment: Union[Experiment, PathLike],
    simulator: Union[str, Simulator, Sequence[Simulator]] = "mujoco",
    *,
    diagnosis: Union[Diagnosis, PathLike, None] = None,
    horizons: Sequence[float] = (0.1, 0.3, 1.0, 3.0),
    runs: int = 8,
    progress: Progress = None,
) -> Verification:
    """Measure in a simulator how far a diagnosis shrinks the gap, on records that nothing was fitted to.

    The nominal and the improved model run under the commands of the log: where it holds ``qref`` and shows the controller,
    a deviation is answered as that controller answers it; otherwise the recorded torques drive the model and a soft spring
    holds it. In MuJoCo both are also compared by inverse dynamics along the log, measured as the diagnosis measures.

    Args:
        experiment: with records of ``use="holdout"``; without any, the fitted ones show what they can.
        simulator: ``"mujoco"``, with the files ``robot.xml`` and ``effects.py`` of the diagnosis; or a function of yours
            ``(q0, dq0, command, dt) -> positions`` that starts at ``q0`` and ``dq0`` ``(joints,)``, is told
            ``command(t, q, dq)`` (N m or N, see :class:`excite.Command`), and gives a row every ``dt`` s,
            ``(command.steps + 1, joints)``; or a pair of them, before and after.
        diagnosis: what to verify, or the folder of it; made from the experiment where left out.
        horizons: lengths of the runs, s; the whole record is added.
        runs: most runs of each length.
        progress: as for :func:`excite.design`.
    """
    own = as_experiment(experiment)
    core = own._native
    robot = Robot(core.plant(), ("native",))
    lengths = sorted({float(h) for h in horizons})
    if not lengths or not all(math.isfinite(h) and h > 0 for h in lengths) or runs < 1:
        raise unusable("horizons are lengths in s, above 0, and runs at least 1")
    found = diagnosis
    if isinstance(found, (str, os.PathLike)):
        found = Diagnosis.read(found)
    if found is None:
        with Bar(progress, "diagnose") as bar:
            report = _excite.diagnose(
                core, next=False, next_tries=0, samples=0, seed=1, atmosphere=101_325.0, progress=bar.report
            )
        found = Diagnosis(report)
    if found.to_dict()["joints"] != robot.joints:
        raise unusable("the diagnosis is of another robot than the experiment")
    said = found.to_dict()
    raw = _excite.series(core)
    names, models, steppers = _simulators(simulator, robot, found)
    warnings = [Notice(*w) for w in core.warnings()]
    chosen = [r for r in raw["records"] if r["holdout"]]
    if not chosen:
        chosen = list(raw["records"])
        warnings.append(
            Notice("no_holdout", "records", "no record is held out: what is measured is how the models fit")
        )
    if any(r.get("payload") == "unknown" for r in core.records()):
        words = "a record carries an unknown load: what the diagnosis found of it is in the model of no record"
        warnings.append(Notice("payload", "records", words))
    feedback = Feedback(said["forward_simulation"])
    torque = _torques(core, raw, models, chosen, said) if models else _no_torques(robot)
    with Bar(progress, "verify") as bar:
        listed = _horizons(chosen, lengths, runs, robot, feedback, steppers, models, bar.report)
    tables = [_table(seconds, of, robot.joints, names) for seconds, of in listed]
    value = {
        "robot": robot.name,
        "simulator": simulator if isinstance(simulator, str) else "functions",
        "version": _version(simulator),
        "models": names,
        "command": feedback.words,
        "records": [r["name"] for r in chosen],
        "holdout": all(r["holdout"] for r in chosen),
        "claims": [{"effect": c["effect"], "joints": c["joints"]} for c in found.claims],
        "torque": torque,
        "horizons": tables,
        "warnings": [w._asdict() for w in warnings],
    }
    value["sentence"] = _sentence(value)
    from ._verify_page import page

    result = Verification(_clean(value), page(_clean(value), listed[-1][1]), warnings)
    emit(warnings)
    return result


def _simulators(
    simulator: Any, robot: Robot, found: Diagnosis
) -> "Tuple[List[str], List[Model], List[Simulator]]":
    if simulator == "mujoco":
        texts = {name: text for name, text, _ in robot._plant.files(robot.values.tolist())}
        nominal = texts.get("robot.xml")
        improved = found.files.get("robot.xml")
        if nominal is None or improved is None:
            raise unusable("the robot has no file for MuJoCo; see the warnings of the diagnosis")
        # what closes loops is in that file for parallel robots, effects or not
        functions = robot._plant.functions() if robot.closed else None
        models = [
            Model(nominal, texts.get("effects.py", functions), robot.joints, "nominal", robot.tree),
            Model(improved, found.files.get("effects.py", functions), robot.joints, "improved", robot.tree),
        ]
        return ["nominal", "improved"], models, []
    given = list(simulator) if isinstance(simulator, (list, tuple)) else [simulator]
    if not 1 <= len(given) <= 2 or not all(callable(f) for f in given):
        raise unusable('simulator is "mujoco", a function (q0, dq0, command, dt) -> positions, or two, before and after')
    return (["nominal", "improved"] if len(given) == 2 else ["simulator"]), [], given


def _version(simulator: Any) -> Optional[str]:
    if simulator != "mujoco":
        return None
    from ._mujoco import mujoco

    return str(mujoco().__version__)


def _torques(
    core: _excite.Experiment, raw: Dict[str, Any], models: List[Model], chosen: List[Any], said: Dict[str, Any]
) -> Dict[str, Any]:
    """The gap of the torques by inverse dynamics, energies in units of the noise variance, and the shrink."""
    joints = said["joints"]
    flat = []
    for model in models:
        parts = model.along(raw["records"], len(joints))
        flat.append(np.ascontiguousarray(np.concatenate(parts).T).reshape(-1))
    energies = _excite.energies(core, flat)
    places = [k for k, r in enumerate(raw["records"]) if any(r is c for c in chosen)]
    lengths = [len(r["tau"]) for r in raw["records"]]
    claims = {c["record"]: c for c in said["records"]}

    def mean(of: Callable[[int], Sequence[float]]) -> Array:
        total = sum(lengths[k] for k in places)
        summed = sum(lengths[k] * np.array([math.nan if x is None else x for x in of(k)], float) for k in places)
        return np.asarray(summed / total)

    measured = [mean(lambda k, m=m: energies[m][k]) for m in range(2)]  # type: ignore[misc]
    claimed = [mean(lambda k, key=key: claims[raw["records"][k]["name"]][key]) for key in ("frozen", "explained")]  # type: ignore[misc]
    least = min(CLEAR * math.sqrt(2.0 / sum(lengths[k] // len(joints) for k in places)), 1.0)
    of_all = least * math.sqrt(len(joints))
    rows = []
    for j, joint in enumerate(joints):
        rows.append(
            {
                "joint": joint,
                "nominal": measured[0][j],
                "improved": measured[1][j],
                "measured": _shrink(measured[0][j], measured[1][j], least),
                "claimed": _shrink(claimed[0][j], claimed[1][j], least),
                "own": claimed[0][j],
            }
        )
    return {
        "unit": "variance of the torque noise",
        "noise": raw["noise"],
        "joints": rows,
        "measured": _shrink(measured[0].sum(), measured[1].sum(), of_all),
        "claimed": _shrink(claimed[0].sum(), claimed[1].sum(), of_all),
    }


def _no_torques(robot: Robot) -> Dict[str, Any]:
    return {"unit": None, "noise": None, "joints": [], "measured": None, "claimed": None}


def _shrink(before: float, after: float, least: float) -> Optional[float]:
    """Share of an energy that is gone; nothing where there was hardly any."""
    if not (math.isfinite(before) and math.isfinite(after)) or before < least:
        return None
    return 1.0 - after / before


def _horizons(
    chosen: List[Any],
    lengths: List[float],
    runs: int,
    robot: Robot,
    feedback: Feedback,
    functions: List[Simulator],
    models: List[Model],
    report: Any,
) -> "List[Tuple[Optional[float], List[_Run]]]":
    longest = max(len(r["tau"]) // max(len(robot.joints), 1) * r["dt"] for r in chosen)
    wanted: List[Optional[float]] = [h for h in lengths if h < 0.9 * longest]
    wanted.append(None)
    out: List[Tuple[Optional[float], List[_Run]]] = []
    gains = {id(r): _of(r, robot, feedback) for r in chosen}
    for n, h in enumerate(wanted):
        of: List[_Run] = []
        for r in chosen:
            for start, stop in _parts(r, robot, h, max(runs // len(chosen), 1)):
                of.append(_run(r, gains[id(r)], start, stop, functions, models))
                if report is not None:
                    report(float(n), float(len(wanted)), "whole records" if h is None else f"{h:g} s")
        out.append((h, of))
    return out


def _of(r: Any, robot: Robot, feedback: Feedback) -> Dict[str, Any]:
    n = len(robot.joints)
    q, dq, tau = (from_columns(r[k], n) for k in ("q", "dq", "tau"))
    if robot.closed:
        inertia = mass(robot, from_columns(r["x"], len(robot.coordinates)))
        # tau = (d tau / d ddx) (d x / d q) ddq
        inertia = inertia @ r["rates"].reshape(len(robot.coordinates), n, -1).transpose(2, 0, 1)
        states = [from_columns(r[k], len(robot.tree or [])) for k in ("tree_q", "tree_dq")]
    else:
        inertia, states = mass(robot, q), [q, dq]
    arrays = {"q": q, "dq": dq, "tau": np.array(tau), "states": states}
    return {**arrays, "gains": feedback.along(inertia), "hold": stiff(inertia, HOLD)}


def _parts(r: Any, robot: Robot, horizon: Optional[float], runs: int) -> "List[Tuple[int, int]]":
    """First and last samples of the runs in a record, spread evenly; there is time before each of them."""
    dt, count = r["dt"], len(r["tau"]) // len(robot.joints)
    first = min(int(math.ceil(BEFORE / dt)), count // 4)
    if horizon is None:
        return [(first, count - 1)]
    steps = max(int(round(horizon / dt)), 1)
    room = count - 1 - first - steps
    if room < 0:
        return [(first, count - 1)]
    many = max(min(runs, room // steps + 1), 1)
    return [(first + room * k // max(many - 1, 1), first + room * k // max(many - 1, 1) + steps) for k in range(many)]


def _run(
    r: Any, a: Dict[str, Any], start: int, stop: int, functions: List[Simulator], models: List[Model]
) -> _Run:
    dt = r["dt"]

    def command(i: int, k: int, gains: str) -> Command:
        kp, kd, ki = (g[i : k + 1] for g in a[gains])
        return Command(a["q"][i : k + 1], a["dq"][i : k + 1], a["tau"][i : k + 1], dt, (kp, kd, ki))

    log = a["q"][start : stop + 1]
    found = []
    for f in functions:
        raw = f(a["q"][start].copy(), a["dq"][start].copy(), command(start, stop, "gains"), dt)
        positions = numbers("the trajectory of the simulator", raw)
        if positions.shape != log.shape:
            raise unusable(f"the simulator must give positions of the shape {log.shape}; its shape is {positions.shape}")
        found.append(positions - log)
    for model in models:
        before, first = None, start
        if model.remembers and start > 0:
            first = max(start - int(math.ceil(BEFORE / dt)), 0)
            before = (command(first, start, "hold"), *(x[first] for x in a["states"]))
        lasting = model.lasts(int(r["order"]), a["q"][:first], a["dq"][:first], dt)
        at, rate = (x[start] for x in a["states"])
        ran = model.run(at, rate, command(start, stop, "gains"), dt, before, lasting)
        found.append(ran - log)
    return _Run(r["name"], start * dt, np.arange(stop - start + 1) * dt, log, found)


def _table(seconds: Optional[float], of: List[_Run], joints: List[str], names: List[str]) -> Dict[str, Any]:
    """Root mean square of the deviation by joint and model, and its shrink."""
    energy = np.array([np.mean(np.concatenate([r.deviation[m] for r in of]) ** 2, axis=0) for m in range(len(names))])
    spread = np.var(np.concatenate([r.log for r in of]), axis=0)
    rows: List[Dict[str, Any]] = []
    for j, joint in enumerate(joints):
        row: Dict[str, Any] = {"joint": joint}
        for m, name in enumerate(names):
            row[name] = float(np.sqrt(energy[m, j]))
        if len(names) == 2:
            row["shrink"] = _shrink(energy[0, j], energy[1, j], TINY**2)
        rows.append(row)
    longest = max(r.t[-1] for r in of)
    out: Dict[str, Any] = {"seconds": longest, "whole": seconds is None, "runs": len(of), "joints": rows}
    if len(names) == 2:
        # of joints that move most, the deviations count least: each against its own motion
        scale = 1.0 / np.maximum(spread, 1e-12)
        out["shrink"] = _shrink(float(energy[0] @ scale), float(energy[1] @ scale), 0.0)
    return out


def _percent(x: Optional[float]) -> str:
    return "not measurable" if x is None else f"{100 * x:.1f} %"


def _sentence(value: Dict[str, Any]) -> str:
    """The result in one sentence."""
    where = "records that nothing was fitted to" if value["holdout"] else "the records that were fitted"
    whole = value["horizons"][-1]
    if len(value["models"]) == 1:
        worst = max(whole["joints"], key=lambda j: j["simulator"])
        return f"the simulator leaves the log by up to {worst['simulator']:.3g} rad or m (rms, {worst['joint']})"
    if not value["claims"]:
        return "the diagnosis claims no effect: both models differ by what was refitted only"
    if value["simulator"] == "mujoco":
        torque = value["torque"]
        return (
            f"{_percent(torque['measured'])} of the torque gap are gone in MuJoCo on {where}, "
            f"{_percent(torque['claimed'])} were claimed; of the deviation of whole runs {_percent(whole['shrink'])} are gone"
        )
    return f"{_percent(whole['shrink'])} of the deviation of whole runs are gone on {where}"


def _clean(value: Any) -> Any:
    """What JSON can hold: numbers that are none become null."""
    if isinstance(value, dict):
        return {k: _clean(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_clean(v) for v in value]
    if isinstance(value, np.ndarray):
        return _clean(value.tolist())
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value
