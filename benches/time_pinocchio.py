#!/usr/bin/env python3
"""Times Pinocchio on the robots that the regressor benchmark uses.

Needs `pip install pin`, a C++ compiler and Eigen 3.4 (`pip download cmeel-eigen`, or the package of
your distribution):

    python benches/time_pinocchio.py --eigen /usr/include/eigen3

Compiles benches/time_pinocchio.cpp against the headers of the Python package, hands it the models read
from the bundled URDFs, and prints microseconds per sample, minimum and median over all repeats.
"""

import argparse
import pathlib
import subprocess
import tempfile

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).resolve().parent

# as Pinocchio's own build files define them
DEFINITIONS = [
    "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
    "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "-DBOOST_FUSION_INVOKE_MAX_ARITY=12",
]


def text(name):
    """One model as time_pinocchio.cpp reads it."""
    model = pin.buildModelFromUrdf(str(HERE.parent / f"src/robot/bundled/{name}.urdf"))
    lines = [f"{name} {model.njoints - 1}"]
    for i in range(1, model.njoints):
        joint, place, inertia = model.joints[i], model.jointPlacements[i], model.inertias[i]
        axis = np.zeros(3)
        if "Unaligned" in joint.shortname():
            axis = joint.extract().axis
        numbers = [axis, place.rotation.ravel(), place.translation, [inertia.mass]]
        numbers += [inertia.lever, inertia.inertia.ravel()]
        line = " ".join(repr(float(x)) for x in np.concatenate(numbers))
        lines.append(f"{model.parents[i]} {joint.shortname()} {line}")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--eigen", default="/usr/include/eigen3", help="folder that holds Eigen/")
    parser.add_argument("--compiler", default="g++")
    parser.add_argument("--flags", default="-O3 -march=native -DNDEBUG -w", help="compiler options")
    parser.add_argument("--repeats", type=int, default=2000, help="passes over 1000 samples")
    parser.add_argument("robots", nargs="*", default=["panda", "ur10"])
    arguments = parser.parse_args()
    # the Python package lies in <prefix>/lib/pythonX.Y/site-packages/pinocchio
    include = pathlib.Path(pin.__file__).resolve().parents[4] / "include"
    with tempfile.TemporaryDirectory() as folder:
        program = pathlib.Path(folder) / "pinocchio"
        command = [arguments.compiler, "-std=c++17", *arguments.flags.split(), *DEFINITIONS]
        command += ["-isystem", arguments.eigen, "-isystem", str(include)]
        command += [str(HERE / "time_pinocchio.cpp"), "-o", str(program)]
        subprocess.run(command, check=True)
        models = "".join(text(name) for name in arguments.robots)
        subprocess.run([program, str(arguments.repeats)], input=models, text=True, check=True)


if __name__ == "__main__":
    main()
