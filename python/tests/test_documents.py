"""The examples of the documents run as they are written."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

import excite

ROOT = Path(__file__).resolve().parents[2]


def blocks(path, heading=None):
    text = (ROOT / path).read_text(encoding="utf-8")
    if heading is not None:
        text = text.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


def test_the_page_about_python(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    found = blocks("docs/python.md")
    assert len(found) == 6 and 8 <= len(found[0].strip().splitlines()) <= 12
    for block in found:
        # what would take ten minutes takes two seconds
        if "MySimulator" in block:
            compile(block, "docs/python.md", "exec")
            continue
        exec(block.replace("time_limit=600", "time_limit=2, collision=False"), names)
    assert names["model"].validation["holdout"]["relative_error"] < 0.02
    assert {"model.json", "robot.urdf", "robot.toml", "report.html"} <= set(os.listdir("model"))


def test_the_readme():
    (block,) = blocks("README.md", "From Python")
    run = excite.simulate("panda", excite.design("panda", starts=1, collision=False), perturb=0.1)
    names = {"t": run.t, "q": run.q, "tau": run.tau}
    exec(block.replace('identify=["viscous", "coulomb"]', 'identify=["viscous", "coulomb"], starts=1, collision=False'),
         names)
    assert names["model"].physically_consistent


def test_the_docstring_of_the_package():
    import doctest

    failed, tried = doctest.testmod(excite)
    assert tried >= 6 and failed == 0


@pytest.mark.parametrize("name", excite.__all__)
def test_everything_is_documented(name):
    thing = getattr(excite, name)
    if name == "__version__":
        return
    assert thing.__doc__, name
    if isinstance(thing, type):
        for own, member in vars(thing).items():
            if not own.startswith("_") and (callable(member) or isinstance(member, (property, classmethod))):
                assert member.__doc__ or getattr(member, "__func__", None).__doc__, f"{name}.{own}"
