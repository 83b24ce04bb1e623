"""A calibration from arrays, as the files that the library reads."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, List, Mapping, Optional, Sequence

import numpy as np

from . import _excite
from ._arrays import Array, columns, finite, numbers
from ._errors import unusable
from ._robot import Robot

#: Columns behind the joint readings.
COLUMNS = {
    "pose": ["x", "y", "z", "qw", "qx", "qy", "qz"],
    "position": ["x", "y", "z"],
    "gauge": ["reading"],
    "point": [],
    "plane": [],
    "loop": [],
}
#: Keys that stand in the file as they are: text, and lists of so many numbers.
TEXTS = ("use", "group", "instrument", "hold")
LISTS = {"base_at": 7, "base_at_std": 2, "target_at": 7, "target_at_std": 2, "grip": 7, "grip_std": 2}
KEYS = {"kind", "q", "values", "std", "angle_std", "cov", *TEXTS, *LISTS}


def write(
    folder: Path,
    robot: Robot,
    measurements: Sequence[Mapping[str, Any]],
    distances: Sequence[Mapping[str, Any]],
    frame: Optional[str],
    other: Optional[str],
    gravity: Optional[str],
    effects: Optional[Sequence[str]],
    tolerances: Optional[Mapping[str, float]],
) -> Path:
    """Write ``calibration.toml`` and what it names into an empty folder."""
    for name, text in robot._texts().items():
        Path(folder, name).write_text(text, encoding="utf-8")
    lines = [f"robot = {json.dumps(robot._named())}"]
    lines += [f"{k} = {json.dumps(v)}" for k, v in (("frame", frame), ("other", other), ("gravity", gravity)) if v is not None]
    if effects is not None:
        lines.append(f"effects = {json.dumps(list(effects))}")
    for k, m in enumerate(measurements):
        lines += _measurement(folder, k, m)
    for d in distances:
        a, b = d["between"]
        lines += ["[[distance]]", f"between = {json.dumps([_file(a), _file(b)])}", f"value = {float(d['value'])!r}"]
        if d.get("std") is not None:
            lines.append(f"std = {float(d['std'])!r}")
    if tolerances:
        lines.append("[prior]")
        lines += [f"{name} = {float(value)!r}" for name, value in tolerances.items()]
    path = Path(folder, "calibration.toml")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _file(k: Any) -> str:
    return f"measurement_{int(k) + 1}.csv"


def _measurement(folder: Path, k: int, m: Mapping[str, Any]) -> List[str]:
    where = f"measurements[{k}]"
    unknown = set(m) - KEYS
    kind = m.get("kind", "pose")
    if unknown or kind not in COLUMNS or "q" not in m:
        raise unusable(f"{where} has the keys {', '.join(sorted(KEYS))}, a kind of {', '.join(COLUMNS)}; not {dict(m)!r:.200}")
    q = _table(f"{where} q", m["q"])
    names = [f"q{j + 1}" for j in range(q.shape[1])]
    data = columns(q)
    wanted = COLUMNS[kind]
    if wanted:
        values = _table(f"{where} values", m.get("values"))
        if values.shape != (len(q), len(wanted)):
            raise unusable(f"{where} values must have the shape ({len(q)}, {len(wanted)}): {' '.join(wanted)}; not {values.shape}")
        names += wanted
        data += columns(values)
    if m.get("cov") is not None:
        cov = finite(f"{where} cov", numbers(f"{where} cov", m["cov"]))
        if cov.shape != (len(q), 6, 6):
            raise unusable(f"{where} cov must have the shape ({len(q)}, 6, 6); not {cov.shape}")
        names += [f"cov_{i}{j}" for i in range(1, 7) for j in range(1, 7)]
        data += columns(cov.reshape(len(q), 36))
    Path(folder, _file(k)).write_text(_excite.table(names, data), encoding="utf-8")
    lines = ["[[measurement]]", f"kind = {json.dumps(kind)}", f"file = {json.dumps(_file(k))}"]
    for key in TEXTS:
        if m.get(key) is not None:
            lines.append(f"{key} = {json.dumps(str(m[key]))}")
    for key in ("std", "angle_std"):
        if m.get(key) is not None:
            lines.append(f"{key} = {float(m[key])!r}")
    for key, count in LISTS.items():
        if m.get(key) is not None:
            values = finite(f"{where} {key}", numbers(f"{where} {key}", m[key]))
            if values.shape != (count,):
                raise unusable(f"{where} {key} must be {count} numbers; its shape is {values.shape}")
            lines.append(f"{key} = {[float(v) for v in values]!r}")
    return lines


def _table(name: str, value: Any) -> Array:
    array = numbers(name, value)
    if array.ndim == 1:
        array = array[:, None]
    if array.ndim != 2 or 0 in array.shape:
        raise unusable(f"{name} must have one row a reading; its shape is {np.shape(value)}")
    return finite(name, array)
