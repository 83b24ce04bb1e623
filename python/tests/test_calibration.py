"""Calibration from arrays: the geometry that was changed is found."""

from __future__ import annotations

import numpy as np
import pytest

import excite


def rotation(axis, angle):
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


URDF = """<robot name="three">
<link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" velocity="1" effort="50"/></joint>
<joint name="j2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.05 0 0.2"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="1" effort="50"/></joint>
<joint name="j3" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="1" effort="50"/></joint>
</robot>"""


def point(q, reach):
    """A point 0.3 m from the last axis, of an arm with another upper link, by rotations."""
    out = []
    for a, b, c in q:
        r1, r2, r3 = rotation((0, 0, 1), a), rotation((0, 1, 0), b), rotation((0, 1, 0), c)
        tip = r3 @ np.array([0.3, 0.02, 0.0])
        out.append(np.array([0, 0, 0.3]) + r1 @ (np.array([0.05, 0, 0.2]) + r2 @ (np.array([reach, 0, 0]) + tip)))
    return np.array(out)


def test_positions():
    rng = np.random.default_rng(1)
    q = rng.uniform(-1.2, 1.2, (60, 3))
    seen = point(q, 0.4015) @ rotation((0, 0, 1), 0.4).T + np.array([1.0, 0.2, 0.1])
    seen += 2e-5 * rng.standard_normal(seen.shape)
    robot = excite.Robot.from_urdf(URDF)
    found = excite.calibrate(
        robot=robot,
        frame="c",
        measurements=[
            {"kind": "position", "q": q[:40], "values": seen[:40], "use": "fit", "instrument": "tracker"},
            {"kind": "position", "q": q[40:], "values": seen[40:], "use": "holdout", "instrument": "tracker"},
        ],
        effects=[],
    )
    assert found.holdout["after"]["mean"] < 1e-4 < found.holdout["before"]["mean"]
    assert found.robot.joints == ["j1", "j2", "j3"]
    assert "<iframe" in found._repr_html_() and len(found.to_frame()) > 5


def test_bad_measurements():
    robot = excite.Robot.from_urdf(URDF)
    q = np.zeros((4, 3))
    for m, words in [
        ({"kind": "smell", "q": q}, "kind"),
        ({"kind": "position", "q": q, "values": np.zeros((3, 3))}, "shape"),
        ({"kind": "position", "q": q, "values": np.full((4, 3), np.nan)}, "finite"),
        ({"kind": "position", "q": q}, "real numbers"),
        ({"q": q, "values": np.zeros((4, 7)), "colour": 1}, "keys"),
        ({"kind": "position", "q": q[:, :2], "values": np.zeros((4, 3))}, "q3"),
    ]:
        with pytest.raises(excite.Error, match=words):
            excite.calibrate(robot=robot, frame="c", measurements=[m])
