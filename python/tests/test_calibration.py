"""Calibration from arrays: the geometry that was changed is found."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

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


def test_known_base():
    """A tracker aligned with the base: nothing of the set-up is left to find but the point of the target."""
    rng = np.random.default_rng(2)
    q = rng.uniform(-1.2, 1.2, (60, 3))
    seen = point(q, 0.4015) + [1.0, 0.2, 0.1] + 2e-5 * rng.standard_normal((60, 3))
    robot = excite.Robot.from_urdf(URDF)
    rows = {"kind": "position", "q": q, "values": seen, "base_at": [1.0, 0.2, 0.1, 1, 0, 0, 0]}
    found = excite.calibrate(robot=robot, frame="c", measurements=[rows], effects=[])
    free = excite.calibrate(robot=robot, frame="c", measurements=[{**rows, "base_at": None}], effects=[])
    assert free.to_dict()["parameters_total"] == found.to_dict()["parameters_total"] + 6
    with pytest.raises(excite.Error, match="base_at do not fit"):
        excite.calibrate(robot=robot, frame="c", measurements=[{**rows, "base_at": [0.5, 0.2, 0.1, 1, 0, 0, 0]}])
    with pytest.raises(excite.Error, match="7 numbers"):
        excite.calibrate(robot=robot, frame="c", measurements=[{**rows, "base_at": [1.0]}])


def test_loops_of_mujoco(tmp_path):
    """The example of two arms that MuJoCo simulates: misses of loops held out fall from centimetres to the noise."""
    pytest.importorskip("mujoco")
    example = Path(__file__).parent.parent / "examples" / "two_arms.py"

    def run(what):
        done = subprocess.run([sys.executable, example, what, tmp_path], capture_output=True, text=True, check=True)
        return done.stdout

    run("make")
    found = excite.calibrate(tmp_path / "calibration.toml")
    found.save(tmp_path / "calibrated")
    said = dict(line.split(": median ") for line in run("check").splitlines())
    median = {name: float(text.split()[0]) for name, text in said.items()}
    assert median["file, loops held out"] > 5 and median["calibrated, loops held out"] < 0.05
    # what one grip does not tell stays where the tolerances have it
    assert median["calibrated, nothing held"] < 0.3 * median["file, nothing held"]


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


def saved(folder, q, seen):
    (folder / "three.urdf").write_text(URDF)
    lines = ["q1,q2,q3,x,y,z,use"]
    for k, row in enumerate(np.hstack([q, seen])):
        lines.append(",".join(map(repr, map(float, row))) + (",fit" if k % 3 else ",holdout"))
    (folder / "seen.csv").write_text("\n".join(lines) + "\n")
    path = folder / "calibration.toml"
    path.write_text(
        'robot = "three.urdf"\nframe = "c"\n[[measurement]]\nkind = "position"\nfile = "seen.csv"\nstd = 2e-5\n'
    )
    return path


def test_diagnosis_of_poses(tmp_path):
    rng = np.random.default_rng(2)
    q = rng.uniform(-1.2, 1.2, (90, 3))
    # an encoder whose disc sits off its middle
    off = q + np.stack([np.zeros(90), 6e-4 * np.sin(q[:, 1] + 0.5), np.zeros(90)], axis=1)
    seen = point(off, 0.4) @ rotation((0, 0, 1), 0.4).T + np.array([1.0, 0.2, 0.1])
    path = saved(tmp_path, q, seen + 2e-5 * rng.standard_normal(seen.shape))
    found = excite.diagnose(path, next=False)
    assert isinstance(found, excite.PoseDiagnosis) and found.verdict == "explained"
    assert [(c["effect"], c["places"]) for c in found.claims] == [("encoder_eccentricity", ["j2"])]
    assert found.holdout_shrink > 0.9 and found.outliers == [] and found.postures is None and found.next is None
    assert "encoder_eccentricity (j2)" in repr(found) and len(found.to_frame()) >= 1
    with pytest.raises(excite.Error, match="calibrate"):
        found.robot
    found.save(tmp_path / "out")
    assert excite.PoseDiagnosis.read(tmp_path / "out").verdict == "explained"
    # the same rows, calibrated from the file
    assert excite.calibrate(path).holdout["after"]["mean"] < 5e-4


def test_a_loop_of_two_arms():
    rng = np.random.default_rng(3)
    two = URDF.replace("</robot>", """<link name="d"/><link name="e"/>
<joint name="k1" type="revolute"><parent link="base"/><child link="d"/><origin xyz="0.5 0 0.3"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" velocity="1" effort="50"/></joint>
<joint name="k2" type="revolute"><parent link="d"/><child link="e"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="1" effort="50"/></joint></robot>""")
    robot = excite.Robot.from_urdf(two)
    q = rng.uniform(-1, 1, (20, 5))
    found = excite.calibrate(
        robot=robot, frame="c", other="e", measurements=[{"kind": "loop", "q": q, "std": 1.0, "angle_std": 1.0}], effects=[]
    )
    assert found.to_dict()["joints"] == ["j1", "j2", "j3", "k1", "k2"]
    with pytest.raises(excite.Error, match="other"):
        excite.calibrate(robot=robot, frame="c", measurements=[{"kind": "loop", "q": q}])
