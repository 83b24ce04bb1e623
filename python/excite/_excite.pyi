"""The parts that are not written in Python. Arrays are one-dimensional, one joint after the other."""

from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
_Notice = Tuple[str, str, str]
_Progress = Optional[Callable[[float, float, str], None]]

__version__: str

class Error(Exception):
    """What could not be done, and why, in the words of the program."""

    kind: str
    """``"argument"``, ``"file"``, ``"io"``, ``"infeasible"``, ``"exists"`` or ``"internal"``"""

class Plant:
    @staticmethod
    def load(spec: str) -> Plant: ...
    @staticmethod
    def from_text(urdf: str, toml: Optional[str], name: str) -> Plant: ...
    def with_terms(self, names: List[str]) -> Plant: ...
    def in_space(self, space: Optional[str]) -> Plant: ...
    def without_collisions(self) -> Plant: ...
    def with_meshes(self, folders: List[str]) -> Plant: ...
    def card(self) -> str: ...
    def warnings(self) -> List[_Notice]: ...
    def regressor(self, q: Array, dq: Array, ddq: Array) -> Array: ...
    def torque(self, q: Array, dq: Array, ddq: Array, phi: Optional[List[float]]) -> Array: ...
    def base(self) -> str: ...
    def random_states(self, count: int, seed: int) -> List[Array]: ...
    def files(self, phi: List[float]) -> List[Tuple[str, Optional[str], str]]: ...
    def functions(self) -> str: ...

class Experiment:
    @staticmethod
    def read(path: Path) -> Experiment: ...
    @staticmethod
    def of(plant: Plant, records: Sequence[Dict[str, Any]]) -> Experiment: ...
    def plant(self) -> Plant: ...
    def warnings(self) -> List[_Notice]: ...
    def records(self) -> List[Dict[str, Any]]: ...

class Report:
    @property
    def json(self) -> str: ...
    @property
    def warnings(self) -> List[_Notice]: ...
    @property
    def files(self) -> List[Tuple[str, str]]: ...
    def html(self) -> str: ...
    def edited_scene(self, scene: Path, folder: Path) -> Tuple[List[Tuple[str, str]], str, List[_Notice]]: ...

def condense(
    experiment: Experiment,
    *,
    cutoff: Optional[float],
    average: bool,
    derive: bool,
    identify: Optional[List[str]],
    atmosphere: float,
) -> Tuple[bytes, List[_Notice]]: ...
def header(factor: bytes) -> str: ...
def merge(
    plant: Plant,
    factors: List[bytes],
    *,
    method: str,
    consistency: str,
    prior: Optional[float],
    identify: Optional[List[str]],
) -> Report: ...
def robots() -> List[Tuple[str, str]]: ...
def formats() -> List[Tuple[str, str]]: ...
def save(folder: Path, files: Sequence[Tuple[str, bytes]], absent: Sequence[str], force: bool) -> List[Path]: ...
def table(names: List[str], columns: List[Array]) -> str: ...
def design(
    plant: Plant,
    *,
    purpose: Optional[str],
    payload: Optional[str],
    harmonics: Optional[int],
    period: Optional[float],
    periods_: Optional[int],
    grid: str,
    diagnostic: bool,
    ends: str,
    start: Optional[List[float]],
    criterion: str,
    condition: Optional[str],
    derate: float,
    rate: float,
    seed: int,
    starts: Optional[int],
    time_limit: Optional[float],
    threads: int,
    spec: str,
    progress: _Progress,
) -> Tuple[Report, str, List[Tuple[str, bool, str, str]], str, Optional[BaseException]]: ...
def assess(plant: Plant, text: Optional[str], payload: Optional[str]) -> Report: ...
def check_trajectory(text: str, name: str) -> str: ...
def sample(text: str, t: Array) -> List[Array]: ...
def write_samples(plant: Plant, text: str, path: Path, rate: float, force: bool) -> None: ...
def simulate(
    plant: Plant,
    text: str,
    *,
    periods: Optional[int],
    lead_in: int,
    rate: float,
    step: float,
    controller: str,
    bandwidth: float,
    damping: float,
    noise: float,
    seed: int,
    effects: Dict[str, Any],
    pose: bool,
    monte_carlo_: Optional[int],
    progress: _Progress,
) -> Dict[str, Any]: ...
def identify(
    experiment: Experiment,
    *,
    method: str,
    consistency: str,
    prior: Optional[float],
    cutoff: Optional[float],
    position_cutoff: Optional[float],
    average: bool,
    derive: bool,
    identify: Optional[List[str]],
    atmosphere: float,
) -> Report: ...
def load(
    experiment: Experiment,
    *,
    parameters: str,
    method: str,
    weighted: bool,
    consistent: bool,
    checked: bool,
    standstill: Optional[float],
    atmosphere: float,
    position_cutoff: Optional[float],
    cutoff: Optional[float],
    flange: List[float],
) -> Report: ...
def diagnose(experiment: Experiment, *, next: bool, next_tries: int, samples: int, seed: int, atmosphere: float, progress: _Progress) -> Report: ...
def is_calibration(path: Path) -> bool: ...
def diagnose_poses(path: Path, *, next: bool, seed: int) -> Report: ...
def calibrate(path: Path, *, algorithm: str, orientation: bool) -> Report: ...
def export(
    text: str,
    name: str,
    plant: Optional[Plant],
    *,
    rate: Optional[float],
    periods: Optional[int],
    speed: float,
    approach: Optional[Path],
    retreat: Optional[Path],
    joints: Optional[List[str]],
    columns: Optional[List[str]],
    units: List[str],
    move_to_start: bool,
) -> Dict[str, Any]: ...
def series(experiment: Experiment) -> Dict[str, Any]: ...
def energies(experiment: Experiment, models: List[Array]) -> List[List[List[float]]]: ...
def main(args: List[str]) -> int: ...
