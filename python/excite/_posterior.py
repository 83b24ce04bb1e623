"""What to randomise: robots that the data do not exclude.

Bodies are sampled about the identified ones in coordinates that only bodies that can exist have: the pseudo-inertia is
``J = L exp(S) L'`` with ``J0 = L L'`` identified and ``S`` symmetric; friction and armature are ``x0 exp(s)``. In these
coordinates the prior of the identification, of strength ``gamma``, is ``gamma |S|^2 / 2`` to second order, and the data
know the base parameters ``pi = T phi`` with their covariance ``C``. A sample minimises, for data ``pi_k ~ N(pi0, C)`` and
a prior ``S_k ~ N(0, 1/gamma)`` that were drawn,

    (T phi(S) - pi_k)' C^-1 (T phi(S) - pi_k) + gamma |S - S_k|^2
"""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Tuple, Union

import numpy as np

from . import _excite
from ._arrays import Array, floats, from_columns, pandas
from ._errors import unusable
from ._robot import PathLike, Robot

if TYPE_CHECKING:
    from ._records import Experiment

#: Weakest prior of what the data do not see: nominal values that are good to 50 %.
WEAKEST = 4.0

#: Fitted samples that tell what a model leaves at a speed and a torque. Chosen on the logs of a TX40 and a Panda: 20 to 50 do
#: there, with 80 a joint that sticks on one side is smeared out.
NEAREST = 40

#: Symmetric unit matrices of order four, of length one.
_PAIRS = [(i, j) for i in range(4) for j in range(i, 4)]


def _units() -> Array:
    out = np.zeros((10, 4, 4))
    for k, (i, j) in enumerate(_PAIRS):
        out[k, i, j] = out[k, j, i] = 1.0 if i == j else np.sqrt(0.5)
    return out


_UNITS = _units()


def pseudo(ten: Array) -> Array:
    """Pseudo-inertia of mass, first moments, and the tensor about the origin xx, xy, xz, yy, yz, zz."""
    m, x, y, z, xx, xy, xz, yy, yz, zz = ten
    half = 0.5 * (xx + yy + zz)
    sigma = np.array([[half - xx, -xy, -xz], [-xy, half - yy, -yz], [-xz, -yz, half - zz]])
    out = np.zeros((4, 4))
    out[:3, :3], out[:3, 3], out[3, :3], out[3, 3] = sigma, (x, y, z), (x, y, z), m
    return out


def ten_of(j: Array) -> Array:
    """The ten parameters of a pseudo-inertia, or of many."""
    xx, yy, zz = j[..., 0, 0], j[..., 1, 1], j[..., 2, 2]
    first = [j[..., 3, 3], j[..., 0, 3], j[..., 1, 3], j[..., 2, 3]]
    tensor = [yy + zz, -j[..., 0, 1], -j[..., 0, 2], xx + zz, -j[..., 1, 2], xx + yy]
    return np.stack(first + tensor, axis=-1)


def folder_of(k: int) -> str:
    """Name of the folder of sample ``k``."""
    return f"sample_{k + 1:04d}"


class Drawn:
    """Robots that records do not exclude."""

    def __init__(self, names: List[str], units: List[str], values: Array) -> None:
        #: names of the columns of the table
        self.names = names
        #: their units
        self.units = units
        #: one row a sample, ``(n, columns)``
        self.values = values

    def __len__(self) -> int:
        return len(self.values)

    def files(self, k: int) -> Dict[str, str]:
        """The robot files of a sample: texts by name."""
        raise NotImplementedError

    def sampled(self, k: int) -> Robot:
        """The robot of a sample."""
        files = self.files(k)
        own = {n: t for n, t in files.items() if n in ("robot.toml", "robot.urdf")}
        return Robot._from_files(own, "robot.toml")

    def to_frame(self) -> Any:
        """One row a sample as a pandas ``DataFrame``."""
        return pandas().DataFrame(self.values, columns=self.names)

    def table(self) -> str:
        """The text of ``samples.csv``."""
        return _excite.table(self.names, [np.ascontiguousarray(c) for c in self.values.T])

    def save(self, folder: PathLike, *, force: bool = False) -> List[Path]:
        """Write ``samples.csv`` and a folder of robot files for each sample."""
        folder = Path(os.fspath(folder))
        paths = _excite.save(folder, [("samples.csv", self.table().encode())], [], force)
        for k in range(len(self)):
            files = [(n, t.encode()) for n, t in self.files(k).items()]
            paths += _excite.save(folder / folder_of(k), files, [], force)
        return paths


class Diagnosed(Drawn):
    """Robots that the records of a diagnosis do not exclude: effects and their rivals stand in them as often as they are
    believed, with what records and prior leave open of all values. See :attr:`excite.Diagnosis.samples`."""

    def __init__(self, about: Dict[str, Any], texts: Dict[str, str]) -> None:
        table = texts["samples.csv"]
        rows = list(csv.reader(table.splitlines()))[1:]
        columns = about["columns"]
        values = np.array([[float(c) if c else np.nan for c in row[1:]] for row in rows])
        super().__init__(
            [c["name"] for c in columns], [c["unit"] for c in columns], values.reshape(len(rows), len(columns))
        )
        #: the effects of each sample: a list of ``effect`` and ``place``
        self.effects: List[List[Dict[str, str]]] = about["effects"]
        #: how their band for 95 % does on records held out: ``covered``, and joint by joint ``covered``, ``spread`` of the samples,
        #: what the fit ``left`` and ``twenty_percent`` on every parameter, N m or N; ``None`` and empty without such records
        self.coverage: Dict[str, Any] = {"covered": about["covered"], "joints": about["joints"]}
        self._table, self._texts = table, texts

    def files(self, k: int) -> Dict[str, str]:
        """The robot files of a sample: texts by name."""
        head = folder_of(range(len(self))[k]) + "/"
        return {name[len(head) :]: text for name, text in self._texts.items() if name.startswith(head)}

    def table(self) -> str:
        """The text of ``samples.csv``."""
        return self._table

    def __repr__(self) -> str:
        kinds = len({str(e) for e in self.effects})
        return f"<excite.Diagnosed: {len(self)} samples with {kinds} sets of effects>"


class Posterior(Drawn):
    """Samples of what the data and the prior leave open. Made by :meth:`excite.Identification.sample`."""

    def __init__(
        self, robot: Robot, names: List[str], units: List[str], values: Array, best: Array, inflation: float
    ) -> None:
        super().__init__(names, units, values)
        #: the identified robot
        self.robot = robot
        #: the identified values, ``(p,)``
        self.best = best
        #: factor on the variances because what the model leaves is correlated in time
        self.inflation = inflation

    def files(self, k: int) -> Dict[str, str]:
        """The robot files of a sample: texts by name."""
        found = self.robot._plant.files(self.values[k].tolist())
        return {name: text for name, text, _ in found if text is not None}

    def torque(self, q: Any, dq: Any = None, ddq: Any = None) -> Array:
        """Torques of all samples, N m or N, ``(n, samples, joints)``; states as for :meth:`excite.Robot.torque`."""
        y = self.robot.regressor(q, dq, ddq)
        known = self.robot.torque(q, dq, ddq, 0.0 * self.best)
        tau: Array = np.einsum("sjp,np->nsj", y, self.values, optimize=True) + known
        return tau

    def coverage(self, experiment: "Union[Experiment, PathLike]", level: float = 0.95) -> Dict[str, Any]:
        """How much of the held-out torque lies in the band of the samples.

        The band is that of the samples and of what the model leaves on motion that it was not fitted to: noise, and what the
        model lacks. That is measured with halves of the fitted records, each predicted by the base parameters that the
        others give, without what those parameters do not know. Friction leaves more at one speed and under one load than
        at others, so a held-out sample counts what the :data:`NEAREST` fitted ones in speed and torque of its joint left;
        ``noise`` is the root mean square of that, N m or N. ``width`` is the width of the samples' band alone beside that
        of ±20 % on every parameter.
        """
        from statistics import NormalDist

        from ._records import as_experiment

        if not 0 < level < 1:
            raise unusable(f"level is a share between 0 and 1, not {level}")
        raw = _excite.series(as_experiment(experiment)._native)
        factor, joints = NormalDist().inv_cdf(0.5 + 0.5 * level), self.robot.joints
        rng = np.random.default_rng(0)
        twenty = self.best * rng.uniform(0.8, 1.2, self.values.shape)
        parts: Dict[bool, List[Tuple[Array, Array, Array, Array]]] = {False: [], True: []}
        halves: List[Tuple[Array, Array]] = []
        kept = self.robot.base().kept
        for r in raw["records"]:
            q, dq, ddq, tau = (from_columns(r[k], len(joints)) for k in ("q", "dq", "ddq", "tau"))
            good = np.flatnonzero(np.array(r["measured"]))
            # of a long record every so many, which is as good
            good = good[:: max(len(good) // 4000, 1)]
            y = self.robot.regressor(q[good], dq[good], ddq[good])
            known = self.robot.torque(q[good], dq[good], ddq[good], 0.0 * self.best)
            left = tau[good] - y @ self.best - known
            wide, usual = (np.einsum("sjp,np->nsj", y, v - v.mean(0), optimize=True).std(0) for v in (self.values, twenty))
            # speed and torque of each joint, the torque as the model has it: the measured one holds what is judged
            state = np.stack([dq[good], tau[good] - left], axis=2)
            parts[bool(r["holdout"])].append((left, wide, usual, state))
            if not r["holdout"]:
                middle = len(good) // 2
                halves += [(y[:middle][:, :, kept], left[:middle]), (y[middle:][:, :, kept], left[middle:])]
        if not parts[True] or not parts[False]:
            raise unusable("coverage needs records to fit and records held out")
        left, wide, usual, state = (np.concatenate(x) for x in zip(*parts[True]))
        noise = _near(np.concatenate([p[3] for p in parts[False]]), *_lacking(halves, self.inflation), state)
        inside = np.abs(left) <= factor * np.sqrt(wide**2 + noise**2)
        spread, width = np.sqrt(np.mean(noise**2, axis=0)), wide.mean(0) / np.maximum(usual.mean(0), 1e-300)
        return {
            "level": level,
            "covered": float(inside.mean()),
            "joints": [
                {"joint": j, "covered": float(c), "noise": float(n), "width": float(w)}
                for j, c, n, w in zip(joints, inside.mean(0), spread, width)
            ],
            "width": float(np.mean(wide / noise) / max(np.mean(usual / noise), 1e-300)),
        }

    def __repr__(self) -> str:
        return f"<excite.Posterior of {self.robot.name}: {len(self)} samples of {len(self.names)} parameters>"


def _lacking(parts: "List[Tuple[Array, Array]]", inflation: float) -> "Tuple[Array, Array]":
    """Squares of what a model leaves on parts of records that its base parameters were not fitted to, without what these
    do not know, and of what is left where all are fitted: ``(samples, joints)`` each."""
    fitted = np.concatenate([left for _, left in parts]) ** 2
    weight = 1.0 / np.sqrt(np.maximum(fitted.mean(0), 1e-300))
    grams, rights = [], []
    for y, left in parts:
        rows, b = (y * weight[:, None]).reshape(-1, y.shape[2]), (left * weight).reshape(-1)
        grams.append(rows.T @ rows)
        rights.append(rows.T @ b)
    total, right = np.sum(grams, axis=0), np.sum(rights, axis=0)
    out = []
    for (y, left), gram, b in zip(parts, grams, rights):
        rest = total - gram
        scale = 1.0 / np.sqrt(np.maximum(np.diag(rest), 1e-300))
        inverse = np.linalg.pinv(rest * np.outer(scale, scale), rcond=1e-10, hermitian=True) * np.outer(scale, scale)
        error = left - y @ (inverse @ (right - b))
        known = np.einsum("sjp,pq,sjq->sj", y, inverse, y, optimize=True)
        out.append(error**2 - inflation * known)
    return np.concatenate(out), fitted


def _near(states: Array, power: Array, least: Array, asked: Array) -> Array:
    """Root mean square of ``power`` of the nearest ``states``, at least that of ``least``: ``(asked, joints)``.

    ``states`` and ``asked`` are ``(samples, joints, 2)``. Distances are in standard deviations of ``states``.
    """
    # of very many, every so many
    every = max(len(states) // 8000, 1)
    states, power, least = states[::every], power[::every], least[::every]
    spread = np.maximum(states.std(0), 1e-300)
    count = min(NEAREST, len(states))
    out = np.empty(asked.shape[:2])
    for j in range(states.shape[1]):
        have = states[:, j] / spread[j]
        for at in range(0, len(asked), 500):
            wanted = asked[at : at + 500, j] / spread[j]
            apart = np.sum((wanted[:, None] - have[None]) ** 2, axis=2)
            near = np.argpartition(apart, count - 1, axis=1)[:, :count]
            found = np.maximum(np.maximum(power[near, j].mean(1), least[near, j].mean(1)), 1e-300)
            out[at : at + 500, j] = np.sqrt(found)
    return out


def sample(robot: Robot, model: Dict[str, Any], result: Dict[str, Any], n: int, seed: int) -> Posterior:
    """Samples of an identification: its robot, its ``model.json`` and its ``identification.json``."""
    listed = model["parameters"]
    names, best = [p["name"] for p in listed], floats(p["value"] for p in listed)
    covariance = np.array([floats(row) for row in model["base_covariance"]])
    if [p.name for p in robot.parameters] != names or robot.closed:
        raise unusable("samples are for serial robots and trees whose robot file could be written")
    base = robot.base()
    t = np.zeros((len(base.kept), len(best)))
    t[np.arange(len(base.kept)), base.kept] = 1.0
    t[:, base.dropped] = base.k
    strength = max(float(result["prior"]["strength"]), WEAKEST)
    coordinates, jacobian = _coordinates(names, best)
    # whitened, by eigenvalues: what is known exactly needs no inverse
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    white = (vectors / np.sqrt(np.maximum(values, 1e-14 * values.max()))).T @ t
    rng = np.random.default_rng(seed)
    inflation = max(float(result["variance_inflation"]), 1.0)
    rows = [_one(best, coordinates, jacobian, white, strength, rng) for _ in range(n)]
    return Posterior(robot, names, [p["unit"] for p in listed], np.array(rows), best, inflation)


def _one(
    best: Array, groups: "List[_Group]", jacobian: Array, white: Array, strength: float, rng: np.random.Generator
) -> Array:
    """One sample: the fit to data and a prior that were disturbed as they are uncertain (randomise, then optimise;
    Bardsley, Solonen, Haario & Laine 2014). The coordinates are not linear, so a few damped Gauss-Newton steps solve it."""
    data = white @ best + rng.standard_normal(len(white))
    prior = rng.standard_normal(jacobian.shape[1]) / np.sqrt(strength)

    def residual(x: Array) -> "Tuple[Array, Array]":
        phi = _moved(best, groups, x)
        return phi, np.concatenate([white @ phi - data, np.sqrt(strength) * (x - prior)])

    # the prior alone is far from the data: from the identified values on
    x: Array = np.zeros(jacobian.shape[1])
    phi, r = residual(x)
    damping = 1e-3
    for _ in range(30):
        slope = np.vstack([white @ _slopes(groups, x, jacobian, best), np.sqrt(strength) * np.eye(len(x))])
        normal, down = slope.T @ slope, slope.T @ r
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -down)
        there, left = residual(x + step)
        if np.isfinite(left).all() and left @ left <= r @ r:
            done = r @ r - left @ left < 1e-6 * len(x)
            x, phi, r, damping = x + step, there, left, max(0.1 * damping, 1e-12)
            if done:
                break
        else:
            damping *= 10.0
            if damping > 1e12:
                break
    return phi


def _slopes(groups: "List[_Group]", x: Array, jacobian: Array, best: Array) -> Array:
    """Derivatives of the parameters at a place in the coordinates: of ``exp(S)`` by its eigenvalues."""
    out: Array = jacobian.copy()
    at, units = 0, _UNITS
    for where, root, kind in groups:
        if root is None:
            if kind == "positive":
                out[where[0], at] = best[where[0]] * np.exp(x[at])
            at += 1
            continue
        values, v = np.linalg.eigh(np.tensordot(x[at : at + 10], units, axes=1))
        e = np.exp(values)
        apart = values[:, None] - values[None, :]
        near = np.abs(apart) < 1e-9
        ratio = np.where(near, 0.5 * (e[:, None] + e[None, :]), (e[:, None] - e[None, :]) / np.where(near, 1.0, apart))
        turned = v @ (ratio * (v.T @ units @ v)) @ v.T
        out[where[0] : where[-1] + 1, at : at + 10] = ten_of(root @ turned @ root.T).T
        at += 10
    return out


#: One group of coordinates: parameters that it moves, and the factor of a pseudo-inertia or nothing for single numbers.
_Group = Tuple[List[int], Optional[Array], str]


def _coordinates(names: List[str], best: Array) -> "Tuple[List[_Group], Array]":
    """Coordinates in which everything can exist, and the derivatives of the parameters with respect to them."""
    groups: List[_Group] = []
    columns: List[Array] = []
    units = _UNITS
    k = 0
    while k < len(names):
        link, _, what = names[k].rpartition(".")
        body = what == "m" and k + 10 <= len(names) and all(n.startswith(link + ".") for n in names[k : k + 10])
        if body:
            at = list(range(k, k + 10))
            j = pseudo(best[k : k + 10])
            values, vectors = np.linalg.eigh(j)
            root = vectors * np.sqrt(np.maximum(values, 1e-15 * values.max()))
            groups.append((at, root, "body"))
            for u in units:
                column = np.zeros(len(best))
                column[at] = ten_of(root @ u @ root.T)
                columns.append(column)
            k += 10
            continue
        column = np.zeros(len(best))
        positive = what != "offset" and best[k] > 0
        column[k] = best[k] if positive else 1.0 + abs(best[k])
        groups.append(([k], None, "positive" if positive else "any"))
        columns.append(column)
        k += 1
    return groups, np.array(columns).T


def _moved(best: Array, groups: "List[_Group]", step: Array) -> Array:
    """The parameters at a place in the coordinates."""
    out: Array = best.copy()
    at, units = 0, _UNITS
    for where, root, kind in groups:
        if root is not None:
            s = np.tensordot(step[at : at + 10], units, axes=1)
            values, vectors = np.linalg.eigh(s)
            out[where] = ten_of(root @ (vectors * np.exp(values)) @ vectors.T @ root.T)
            at += 10
            continue
        x = best[where[0]]
        out[where[0]] = x * np.exp(step[at]) if kind == "positive" else x + (1.0 + abs(x)) * step[at]
        at += 1
    return out
