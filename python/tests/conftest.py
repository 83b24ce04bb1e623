"""What the tests share: a small robot, its motions and its logs."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import excite


def program() -> list[str]:
    """The program to compare with: the one that is named, one that is built, or the one of the package."""
    named = os.environ.get("EXCITE_PROGRAM")
    if named:
        return [named]
    return [sys.executable, "-m", "excite"]


class Program:
    """Runs the program in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(self, *args: str, status: int = 0) -> str:
        done = subprocess.run(
            [*program(), *args], cwd=self.folder, capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == status, (args, done.returncode, done.stderr)
        return done.stdout if status == 0 else done.stderr

    def read(self, name: str) -> str:
        return (self.folder / name).read_text(encoding="utf-8")


@pytest.fixture(autouse=True)
def quiet():
    """Warnings of excite are looked at where a test is about them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", excite.ExciteWarning)
        yield


@pytest.fixture(scope="session")
def chain(tmp_path_factory):
    """The whole chain by the program: robot, motions, logs, experiment; as a user of files has it."""
    folder = tmp_path_factory.mktemp("chain")
    run = Program(folder)
    for name, seed in (("fit", "1"), ("check", "2")):
        run("design", "planar2", "--starts", "2", "--period", "4", "--seed", seed, "--identify", "viscous,coulomb",
            "--output", name)
    common = ["--periods", "3", "--rate", "250", "--perturb", "0.2", "--nonlinear-viscous-friction", "1.5"]
    for name, use in (("fit", "fit"), ("check", "holdout")):
        run("simulate", "planar2", f"{name}/trajectory.json", *common, "--output", f"{name}.csv", "--experiment",
            "experiment.toml", "--use", use)
    yield run
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="session")
def robot():
    return excite.Robot.load("planar2")


@pytest.fixture(scope="session")
def plan(robot):
    return excite.design(robot, starts=2, period=4, seed=1, identify=["viscous", "coulomb"])


@pytest.fixture(scope="session")
def logs(robot, plan):
    """The records of the chain, from memory."""
    check = excite.design(robot, starts=2, period=4, seed=2, identify=["viscous", "coulomb"])
    settings = {"periods": 3, "rate": 250, "perturb": 0.2, "nonlinear_viscous_friction": 1.5}
    return [
        excite.simulate(robot, plan, **settings).record(name="fit"),
        excite.simulate(robot, check, **settings).record("holdout", name="check"),
    ]


@pytest.fixture(scope="session")
def experiment(robot, logs):
    return excite.Experiment(robot, logs)
