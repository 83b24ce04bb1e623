"""Exciting trajectories for robots: designed, proven inside the limits, identified and diagnosed.

>>> import excite
>>> robot = excite.Robot.load("planar2")
>>> plan = excite.design(robot, starts=2)
>>> log = excite.simulate(robot, plan.trajectory, periods=3, perturb=0.1)
>>> model = excite.identify(excite.Experiment(robot, [log.record()]))
>>> model.physically_consistent
True

Arrays have one row a sample: ``q`` is ``(samples, joints)``. SI units everywhere: rad, m, s, N, N m, kg. The keyword
arguments are the options of the program ``excite``, and so are the numbers that come out.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._command import Command
    from ._condense import Factor, Merged, condense, merge
    from ._errors import Error, ExciteWarning, Notice
    from ._excite import __version__
    from ._planned import Assessment, Design, Export, Interrupted, Simulation
    from ._posterior import Diagnosed, Posterior
    from ._records import Experiment, Record
    from ._results import Calibration, Diagnosis, Identification, Load, PoseDiagnosis, Result
    from ._robot import BaseParameters, Parameter, Robot
    from ._simulate import simulate
    from ._trajectory import Motion, Samples, Trajectory
    from ._verbs import (
        assess,
        calibrate,
        design,
        diagnose,
        export,
        formats,
        identify,
        load,
        robots,
    )
    from ._verify import Verification, verify

#: What is imported when it is used first: NumPy takes longer than all of this package.
_PARTS = {
    "_command": ("Command",),
    "_condense": ("Factor", "Merged", "condense", "merge"),
    "_errors": ("Error", "ExciteWarning", "Notice"),
    "_excite": ("__version__",),
    "_posterior": ("Diagnosed", "Posterior"),
    "_records": ("Experiment", "Record"),
    "_planned": ("Assessment", "Design", "Export", "Interrupted", "Simulation"),
    "_results": ("Calibration", "Diagnosis", "Identification", "Load", "PoseDiagnosis", "Result"),
    "_robot": ("BaseParameters", "Parameter", "Robot"),
    "_simulate": ("simulate",),
    "_trajectory": ("Motion", "Samples", "Trajectory"),
    "_verbs": ("assess", "calibrate", "design", "diagnose", "export", "formats", "identify", "load", "robots"),
    "_verify": ("Verification", "verify"),
}

__all__ = [
    "Assessment",
    "BaseParameters",
    "Calibration",
    "Command",
    "Design",
    "Diagnosed",
    "Diagnosis",
    "Error",
    "ExciteWarning",
    "Experiment",
    "Export",
    "Factor",
    "Identification",
    "Interrupted",
    "Load",
    "Merged",
    "Motion",
    "Notice",
    "Parameter",
    "PoseDiagnosis",
    "Posterior",
    "Record",
    "Result",
    "Robot",
    "Samples",
    "Simulation",
    "Trajectory",
    "Verification",
    "__version__",
    "assess",
    "calibrate",
    "condense",
    "design",
    "diagnose",
    "export",
    "formats",
    "identify",
    "load",
    "merge",
    "robots",
    "simulate",
    "verify",
]


def __getattr__(name: str) -> object:
    for part, names in _PARTS.items():
        if name in names:
            value = getattr(_import_module(f"{__name__}.{part}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> "list[str]":
    return sorted([*globals(), *__all__])
