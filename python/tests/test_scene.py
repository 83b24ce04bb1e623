"""A model in the user's own file."""

import warnings
from pathlib import Path

import pytest

import excite

SCENE = """<mujoco>
  <!-- mine -->
  <worldbody>
    <body name="arm" pos="0 0 1">
      <joint name="j" axis="0 1 0" damping="0.5"/>
      <inertial pos="0 0 0.2" mass="2" diaginertia="0.03 0.03 0.01"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture()
def model(tmp_path: Path) -> excite.Identification:
    (tmp_path / "scene.xml").write_text(SCENE)
    robot = excite.Robot.load(tmp_path / "scene.xml")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", excite.ExciteWarning)
        plan = excite.design(robot, starts=1, collision=False, harmonics=3, identify=["viscous"])
        record = excite.simulate(robot, plan, periods=2, perturb=0.3, seed=3).record()
        return excite.identify(excite.Experiment(robot, [record]), identify=["viscous"])


def test_into_a_scene(model: excite.Identification, tmp_path: Path) -> None:
    said = model.into(tmp_path / "scene.xml", tmp_path / "out")
    text = (tmp_path / "out" / said["file"]).read_text()
    assert "<!-- mine -->" in text
    damping = [c for c in said["changes"] if c["attribute"] == "damping"]
    assert len(damping) == 1 and damping[0]["old"] == "0.5"
    again = excite.Robot.load(tmp_path / "out" / said["file"]).with_terms(["viscous"])
    wanted = model.robot.with_terms(["viscous"])
    assert again.values == pytest.approx(wanted.values, abs=1e-9)
    with pytest.raises(excite.Error):
        model.into(tmp_path / "scene.xml", tmp_path)
    with pytest.raises(excite.Error):
        model.into(tmp_path / "scene.xml", tmp_path / "out")
    model.into(tmp_path / "scene.xml", tmp_path / "out", force=True)
