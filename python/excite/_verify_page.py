"""The report of a verification: one page, plots drawn as SVG."""

from __future__ import annotations

import html
import math
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from ._arrays import Array

COLOURS = ("#b8432f", "#1f6f8b", "#8a6d1f", "#4b7f52", "#6b4c9a", "#444444", "#c07a00", "#2f4b7c")
STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:980px;margin:2em auto;padding:0 1em;color:#222;background:#fff}
h1{font-size:1.5em;margin-bottom:.2em}h2{font-size:1.15em;margin-top:1.8em}
p.verdict{font-size:1.1em;border-left:4px solid #1f6f8b;padding:.4em .8em;background:#f3f7f9}
table{border-collapse:collapse;margin:.6em 0}td,th{padding:.25em .8em;text-align:right;border-bottom:1px solid #ddd}
td:first-child,th:first-child{text-align:left}th{font-weight:600;border-bottom:2px solid #999}
.note{color:#555;font-size:.92em}svg{max-width:100%;height:auto}
@media(prefers-color-scheme:dark){body{color:#ddd;background:#1b1d1f}p.verdict{background:#22303a}
td,th{border-color:#444}.note{color:#aaa}svg text{fill:#ccc}svg .axis{stroke:#777}}
"""


def text(value: Any) -> str:
    """Text that may stand in a page."""
    return html.escape(str(value))


def percent(x: Optional[float]) -> str:
    """A share, or why there is none."""
    return "–" if x is None else f"{100 * x:.1f} %"


def figure(x: Optional[float]) -> str:
    """A figure with three digits."""
    return "–" if x is None else f"{x:.3g}"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; the cells are text."""
    top = "".join(f"<th>{text(h)}</th>" for h in head)
    body = "".join("<tr>" + "".join(f"<td>{text(c)}</td>" for c in r) + "</tr>" for r in rows)
    return f"<table><tr>{top}</tr>{body}</table>"


def ticks(low: float, high: float) -> "List[float]":
    """Round numbers within a range."""
    width = max(high - low, 1e-300)
    step = 10 ** math.floor(math.log10(width / 4))
    step *= next(k for k in (1, 2, 5, 10) if width / (step * k) <= 6)
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, int(math.floor(high / step + 1e-9)) + 1)]


def plot(
    lines: "Sequence[Tuple[str, Array, Array]]",
    x_label: str,
    y_label: str,
    *,
    log: bool = False,
    y_range: "Optional[Tuple[float, float]]" = None,
    dots: bool = False,
) -> str:
    """Lines over one another; ``log``: of the horizontal axis."""
    wide, tall, left, right, top, bottom = 920.0, 300.0, 76.0, 170.0, 14.0, 46.0
    good = [(n, np.asarray(x, float), np.asarray(y, float)) for n, x, y in lines]
    good = [(n, x[np.isfinite(y)], y[np.isfinite(y)]) for n, x, y in good]
    good = [(n, x, y) for n, x, y in good if len(x)]
    if not good:
        return '<p class="note">There is nothing to draw.</p>'
    xs = np.concatenate([np.log10(x) if log else x for _, x, _ in good])
    ys = np.concatenate([y for _, _, y in good])
    x0, x1 = float(xs.min()), float(xs.max())
    y0, y1 = y_range or (float(ys.min()), float(ys.max()))
    x1, y1 = (x1 if x1 > x0 else x0 + 1.0), (y1 if y1 > y0 else y0 + 1.0)
    if y_range is None:
        y0, y1 = y0 - 0.05 * (y1 - y0), y1 + 0.05 * (y1 - y0)

    def px(x: Any) -> Any:
        return left + (np.asarray(x) - x0) / (x1 - x0) * (wide - left - right)

    def py(y: Any) -> Any:
        return tall - bottom - (np.clip(np.asarray(y), y0, y1) - y0) / (y1 - y0) * (tall - top - bottom)

    out = [f'<svg viewBox="0 0 {wide:g} {tall:g}" width="{wide:g}" height="{tall:g}" role="img">']
    out.append(
        f'<path class="axis" d="M{left:g} {top:g}V{tall - bottom:g}H{wide - right:g}" fill="none" stroke="#888"/>'
    )
    marks = [math.log10(v) for v in sorted({float(v) for _, x, _ in good for v in x})] if log else ticks(x0, x1)
    for v in marks:
        label = f"{10**v:.3g}" if log else f"{v:.6g}"
        out.append(f'<text x="{px(v):.1f}" y="{tall - bottom + 17:g}" font-size="12" text-anchor="middle">{label}</text>')
    for v in ticks(y0, y1):
        level = float(py(v))
        out.append(f'<path class="axis" d="M{left:g} {level:.1f}H{wide - right:g}" stroke="#888" stroke-opacity=".25"/>')
        out.append(f'<text x="{left - 7:g}" y="{level + 4:.1f}" font-size="12" text-anchor="end">{v:.4g}</text>')
    for k, (name, x, y) in enumerate(good):
        colour = COLOURS[k % len(COLOURS)]
        x = np.log10(x) if log else x
        step = max(len(x) // 3000, 1)
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(px(x[::step]), py(y[::step])))
        out.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.6"/>')
        if dots:
            out += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{colour}"/>' for a, b in zip(px(x), py(y))]
        row = top + 14 + 17 * k
        out.append(f'<path d="M{wide - right + 12:g} {row - 4:g}h18" stroke="{colour}" stroke-width="2.5"/>')
        out.append(f'<text x="{wide - right + 36:g}" y="{row:g}" font-size="12">{text(name)}</text>')
    middle = (left + wide - right) / 2
    out.append(f'<text x="{middle:g}" y="{tall - 8:g}" font-size="13" text-anchor="middle">{text(x_label)}</text>')
    out.append(
        f'<text transform="translate(16 {(top + tall - bottom) / 2:g}) rotate(-90)" font-size="13" '
        f'text-anchor="middle">{text(y_label)}</text></svg>'
    )
    return "".join(out)


def page(value: Dict[str, Any], whole: "List[Any]") -> str:
    """The page; ``whole`` are the runs of whole records."""
    where = f"MuJoCo {value['version']}" if value["simulator"] == "mujoco" else "a simulator of your own"
    sentence = value["sentence"][:1].upper() + value["sentence"][1:]
    names = value["models"]
    out = [
        '<!DOCTYPE html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">',
        f"<title>{text(value['robot'])} in {text(where)}</title><style>{STYLE}</style>",
        f"<h1>{text(value['robot'])} in {text(where)}</h1>",
        f'<p class="verdict">{text(sentence)}.</p>',
        f'<p class="note">Records: {text(", ".join(value["records"]))}. Effects that the diagnosis claims: '
        f'{text("; ".join(c["effect"] + (" (" + ", ".join(c["joints"]) + ")" if c["joints"] else "") for c in value["claims"]) or "none")}.</p>',
    ]
    for w in value["warnings"]:
        out.append(f'<p class="note">Warning: {text(w["subject"])}: {text(w["message"])}</p>')
    if value["torque"]["joints"]:
        out += _torque(value["torque"])
    out.append("<h2>Runs: how far the model leaves the log</h2>")
    out.append(f"<p>Each run starts in a state of the log and is told {text(value['command'])}.</p>")
    two = len(names) == 2
    if two:
        seconds = np.array([h["seconds"] for h in value["horizons"]])
        joints = [j["joint"] for j in value["horizons"][0]["joints"]]
        lines = [("all joints", seconds, _numbers([h["shrink"] for h in value["horizons"]]))]
        for j, joint in enumerate(joints):
            lines.append((joint, seconds, _numbers([h["joints"][j]["shrink"] for h in value["horizons"]])))
        lowest = min((float(np.nanmin(y)) for _, _, y in lines if np.isfinite(y).any()), default=0.0)
        scaled = [(n, x, 100 * y) for n, x, y in lines]
        low = 100 * max(min(lowest, 0.0), -1.0)
        out.append(plot(scaled, "length of the runs, s", "energy gone, %", log=True, y_range=(low, 100.0), dots=True))
    head = ["length, s", "runs", "joint", *[f"{n}, rms" for n in names], *(["gone"] if two else [])]
    rows = []
    for h in value["horizons"]:
        for k, j in enumerate(h["joints"]):
            first = [f"{h['seconds']:.3g}", str(h["runs"])] if k == 0 else ["", ""]
            rows.append([*first, j["joint"], *[figure(j[n]) for n in names], *([percent(j["shrink"])] if two else [])])
    out.append(table(head, rows))
    out.append('<p class="note">Root mean square of the deviation from the log, rad or m. The noise of the recorded torques moves a model that is right, too: '
        "that much is left of it.</p>")
    out += _course(value, whole)
    out.append("</html>")
    return "\n".join(out)


def _numbers(values: Sequence[Optional[float]]) -> Array:
    return np.array([math.nan if v is None else v for v in values], dtype=np.float64)


def _torque(torque: Dict[str, Any]) -> "List[str]":
    rows = [
        [j["joint"], figure(j["nominal"]), figure(j["improved"]), percent(j["measured"]), percent(j["claimed"])]
        for j in torque["joints"]
    ]
    rows.append(["all", "", "", percent(torque["measured"]), percent(torque["claimed"])])
    return [
        "<h2>Torques: inverse dynamics along the log</h2>",
        table(["joint", "gap, nominal", "gap, improved", "gone, measured here", "gone, claimed"], rows),
        '<p class="note">Energy of what is measured less what the model has, above the noise, in units of the variance of the '
        "torque noise. A joint whose gap is below its noise shows no shrink (–).</p>",
    ]


def _course(value: Dict[str, Any], whole: "List[Any]") -> "List[str]":
    """The joint that deviates most, over the whole record."""
    names = value["models"]
    run = whole[0]
    sizes = [np.nanmax(np.abs(d), axis=0) for d in run.deviation]
    span = np.maximum(np.ptp(run.log, axis=0), 1e-9)
    worst = int(np.nanargmax(sizes[0] / span))
    joint = value["horizons"][-1]["joints"][worst]["joint"]
    lines = [(n, run.start + run.t, d[:, worst]) for n, d in zip(names, run.deviation)]
    return [
        f"<h2>{text(joint)} over the record {text(run.record)}</h2>",
        plot(lines, "time, s", "deviation, rad or m"),
    ]
