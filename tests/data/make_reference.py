#!/usr/bin/env python3
"""Writes the figures that tests/robots/reference.rs compares with: torques and regressors of Pinocchio.

    pip install pin numpy
    python tests/data/make_reference.py            # in the root of the repository

For every bundled robot and for tree.urdf beside this script, `<robot>.json`:

    made_with            versions of Pinocchio and NumPy
    gravity              base axes, m/s^2
    coordinates          names of the joints, in the order of q, qd, qdd, tau and of the rows
    bodies               name of the joint that carries each body, in the order of the columns
    states               random states, each with
        q, qd, qdd       rad or m, and derivatives
        tau              pinocchio.rnea, without joint terms, N m or N
        regressor        pinocchio.computeJointTorqueRegressor, row by row, ten columns a body in
                         the order m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz; rows that are zero
                         for a body hold null instead of ten zeros (only the first two states)
    rank                 numeric rank of the regressor stacked over random states: columns scaled to
                         unit length, the widest gap between neighbouring singular values
    rank_gap             that gap
    trajectory           (panda, ur10) Fourier series q = constant + sum of sin[h] sin(h w t) +
                         cos[h] cos(h w t), w = 2 pi / period
    invariant            its condition number: largest singular value of the stacked regressor at
                         100 Hz, one period, end point left out, over the one at `rank`

A joint that mimics another one is computed as a joint of its own and added to the coordinate it
follows, by virtual work: q_joint = multiplier q + offset, tau = sum of multiplier tau_joint.
"""

import json
import pathlib
import tomllib
import xml.etree.ElementTree as xml

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).resolve().parent
BUNDLED = HERE.parent.parent / "src/robot/bundled"
ROBOTS = ["panda", "ur10", "ur10e", "ur5e", "iiwa14", "puma560", "scara", "planar2", "fr3"]

# Pinocchio: m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz
ORDER = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]


class Robot:
    """A model of Pinocchio in the coordinates of the URDF."""

    def __init__(self, urdf, gravity):
        self.model = pin.buildModelFromUrdf(str(urdf))
        self.model.gravity.linear = np.array(gravity)
        self.data = self.model.createData()
        joints = [j for j in xml.parse(urdf).getroot().findall("joint") if j.get("type") != "fixed"]
        mimics = {j.get("name"): j.find("mimic") for j in joints}
        self.names = [name for name, mimic in mimics.items() if mimic is None]
        self.bodies = list(self.model.names)[1:]
        # for each joint of the model: coordinate, multiplier, offset
        self.follows = []
        for name in self.bodies:
            mimic = mimics[name]
            if mimic is None:
                self.follows.append((self.names.index(name), 1.0, 0.0))
            else:
                factor, offset = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
                self.follows.append((self.names.index(mimic.get("joint")), factor, offset))

    def state(self, q, qd, qdd):
        """Configuration, velocity and acceleration as the model wants them."""
        configuration, v, a = np.zeros(self.model.nq), np.zeros(self.model.nv), np.zeros(self.model.nv)
        for joint, (c, factor, offset) in zip(list(self.model.joints)[1:], self.follows):
            x = factor * q[c] + offset
            if joint.nq == 2:  # an unbounded rotation is held as cosine and sine
                configuration[joint.idx_q : joint.idx_q + 2] = np.cos(x), np.sin(x)
            else:
                configuration[joint.idx_q] = x
            v[joint.idx_v], a[joint.idx_v] = factor * qd[c], factor * qdd[c]
        return configuration, v, a

    def gather(self, rows):
        """Rows of the model's joints to rows of the coordinates."""
        out = np.zeros((len(self.names),) + rows.shape[1:])
        for joint, (c, factor, _) in zip(list(self.model.joints)[1:], self.follows):
            out[c] += factor * rows[joint.idx_v]
        return out

    def torque(self, q, qd, qdd):
        return self.gather(pin.rnea(self.model, self.data, *self.state(q, qd, qdd)))

    def regressor(self, q, qd, qdd):
        y = pin.computeJointTorqueRegressor(self.model, self.data, *self.state(q, qd, qdd))
        n = len(self.bodies)
        return self.gather(y.reshape(-1, n, 10)[:, :, ORDER].reshape(-1, 10 * n))

    def random(self, rng):
        n = len(self.names)
        return rng.uniform(-2, 2, n), rng.uniform(-3, 3, n), rng.uniform(-8, 8, n)


def rank(w):
    """Rank and the gap behind it."""
    norms = np.linalg.norm(w, axis=0)
    live = norms > 1e-9 * norms.max()
    s = np.linalg.svd(w[:, live] / norms[live], compute_uv=False)
    s = np.append(s / s[0], 0.0)
    gaps = s[:-1] / np.maximum(s[1:], 1e-17)
    r = int(np.argmax(gaps))
    return r + 1, float(gaps[r])


def trajectory(robot, rng):
    """A series inside moderate positions with falling amplitudes."""
    harmonics = [1, 2, 3, 4, 5]
    joints = [
        {
            "constant": float(rng.uniform(-0.5, 0.5)),
            "sin": [float(rng.uniform(-0.6, 0.6) / h) for h in harmonics],
            "cos": [float(rng.uniform(-0.6, 0.6) / h) for h in harmonics],
        }
        for _ in robot.names
    ]
    return {"period": 8.0, "harmonics": harmonics, "joints": joints}


def evaluate(series, t):
    """Positions, velocities and accelerations of all joints at time t."""
    w = 2.0 * np.pi / series["period"] * np.array(series["harmonics"])
    sin, cos = np.sin(w * t), np.cos(w * t)
    q, qd, qdd = [], [], []
    for joint in series["joints"]:
        a, b = np.array(joint["sin"]), np.array(joint["cos"])
        q.append(joint["constant"] + a @ sin + b @ cos)
        qd.append((a * w) @ cos - (b * w) @ sin)
        qdd.append(-(a * w * w) @ sin - (b * w * w) @ cos)
    return q, qd, qdd


def reference(name, urdf, gravity, seed):
    robot, rng = Robot(urdf, gravity), np.random.default_rng(seed)
    states = []
    for k in range(5):
        q, qd, qdd = robot.random(rng)
        state = {"q": q, "qd": qd, "qdd": qdd, "tau": robot.torque(q, qd, qdd)}
        state = {key: value.tolist() for key, value in state.items()}
        y = robot.regressor(q, qd, qdd)
        phi = np.concatenate([i.toDynamicParameters()[ORDER] for i in list(robot.model.inertias)[1:]])
        np.testing.assert_allclose(y @ phi, state["tau"], rtol=1e-11, atol=1e-11)
        if k < 2:
            blocks = [np.split(row, len(robot.bodies)) for row in y]
            state["regressor"] = [[b.tolist() if b.any() else None for b in row] for row in blocks]
        states.append(state)
    w = np.vstack([robot.regressor(*robot.random(rng)) for _ in range(200)])
    r, gap = rank(w)
    out = {
        "robot": name,
        "made_with": f"pinocchio {pin.__version__}, numpy {np.__version__}",
        "gravity": list(gravity),
        "coordinates": robot.names,
        "bodies": robot.bodies,
        "states": states,
        "rank": r,
        "rank_gap": gap,
    }
    if name in ("panda", "ur10"):
        series = trajectory(robot, rng)
        times = np.arange(round(100 * series["period"])) / 100.0
        w = np.vstack([robot.regressor(*evaluate(series, t)) for t in times])
        s = np.linalg.svd(w, compute_uv=False)
        out["trajectory"], out["invariant"] = series, float(s[0] / s[r - 1])
    text = json.dumps(out)
    text = text.replace('{"q"', '\n{"q"').replace(', "rank"', ',\n"rank"').replace(", [[", ",\n[[")
    (HERE / f"{name}.json").write_text(text + "\n")
    print(f"{name:8} {len(text):6} bytes, rank {r} (gap {gap:.1e})", out.get("invariant", ""))


def main():
    for seed, name in enumerate(ROBOTS):
        settings = tomllib.loads((BUNDLED / f"{name}.toml").read_text())
        gravity = settings.get("gravity", [0.0, 0.0, -9.81])
        reference(name, BUNDLED / settings["urdf"], gravity, seed)
    reference("tree", HERE / "tree.urdf", [0.7, -1.1, -9.7], 100)


if __name__ == "__main__":
    main()
