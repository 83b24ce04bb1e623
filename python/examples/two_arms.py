"""Two arms that hold the same thing, simulated by MuJoCo: loops for `excite calibrate`, and a check of what it gives.

    python two_arms.py make FOLDER
    excite calibrate FOLDER/calibration.toml --output FOLDER/calibrated
    python two_arms.py check FOLDER

`make` writes the robot as drawn (URDF), and readings at postures that a robot with errors (MJCF, 2 mm and 5 mrad a joint)
takes while its arms hold the same thing. `check` reads the calibrated URDF into MuJoCo and compares it with the true robot:
in loops held out, and in postures where nothing is held. Needs numpy and mujoco.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np

# joint, parent link, place and turn (roll, pitch, yaw) in the parent, axis
ARMS = [
    ("l1", "base", (0.1, 0.35, 0.4), (0.0, 0.0, 0.3), (0, 0, 1)),
    ("l2", "l1", (0.0, 0.0, 0.15), (0.0, 0.2, 0.0), (0, 1, 0)),
    ("l3", "l2", (0.03, 0.0, 0.3), (0.0, 0.0, 0.0), (0, 0, 1)),
    ("l4", "l3", (-0.03, 0.0, 0.12), (0.0, 0.6, 0.0), (0, 1, 0)),
    ("l5", "l4", (0.0, 0.0, 0.28), (0.0, 0.0, 0.0), (0, 0, 1)),
    ("l6", "l5", (0.0, 0.0, 0.05), (0.0, 0.4, 0.0), (0, 1, 0)),
    ("l7", "l6", (0.06, 0.0, 0.08), (0.0, 0.0, 0.0), (0, 0, 1)),
    ("r1", "base", (0.1, -0.4, 0.4), (0.0, 0.0, -0.2), (0, 0, 1)),
    ("r2", "r1", (0.0, 0.05, 0.12), (0.0, 0.3, 0.0), (0, 1, 0)),
    ("r3", "r2", (0.0, 0.0, 0.36), (0.0, 0.5, 0.0), (0, 1, 0)),
    ("r4", "r3", (0.0, 0.0, 0.32), (0.0, 0.4, 0.0), (0, 1, 0)),
    ("r5", "r4", (0.0, 0.08, 0.0), (0.0, 0.0, 0.0), (0, 0, 1)),
    ("r6", "r5", (0.0, 0.0, 0.09), (0.0, 0.3, 0.0), (0, 1, 0)),
]
TOOLS = [("left", "l7", (0.0, 0.0, 0.12)), ("right", "r6", (0.0, 0.02, 0.14))]
LIMIT = 2.2
LENGTH, ANGLE = 0.002, 0.005
NOISE = (5e-5, 1e-4)
FITTED, HELD_OUT = 60, 200


def turn(w):
    """Rotation matrix of a rotation vector."""
    angle = np.linalg.norm(w)
    k = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    if angle < 1e-12:
        return np.eye(3) + k
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * k @ k


def vector(r):
    """Rotation vector of a rotation matrix."""
    q, w = np.zeros(4), np.zeros(3)
    mujoco.mju_mat2Quat(q, r.flatten())
    mujoco.mju_quat2Vel(w, q, 1.0)
    return w


def drawn(rpy):
    a, b, c = (turn(v * np.eye(3)[k]) for k, v in enumerate(rpy))
    return c @ b @ a


def urdf():
    inertial = '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
    out = ['<robot name="two_arms_of_another_kind">', '<mujoco><compiler fusestatic="false"/></mujoco>', '<link name="base"/>']
    write = lambda v: " ".join(map(str, v))
    for name, parent, xyz, rpy, axis in ARMS:
        out += [
            f'<link name="{name}">{inertial}</link>',
            f'<joint name="{name}_joint" type="revolute"><parent link="{parent}"/><child link="{name}"/>'
            f'<origin xyz="{write(xyz)}" rpy="{write(rpy)}"/><axis xyz="{write(axis)}"/>'
            f'<limit lower="-{LIMIT}" upper="{LIMIT}" velocity="3" effort="100"/></joint>',
        ]
    for name, parent, xyz in TOOLS:
        out += [
            f'<link name="{name}">{inertial}</link>',
            f'<joint name="{name}_mount" type="fixed"><parent link="{parent}"/><child link="{name}"/>'
            f'<origin xyz="{write(xyz)}" rpy="0 0 0"/></joint>',
        ]
    return "\n".join(out + ["</robot>", ""])


def mjcf(rng):
    """The same arms with errors, as bodies of MuJoCo."""
    def body(name):
        inside = [b for b in ARMS if b[1] == name]
        tools = [t for t in TOOLS if t[1] == name]
        text = ""
        for child, _, xyz, rpy, axis in inside:
            text += frame(child, xyz, drawn(rpy)) + f'<joint name="{child}_joint" axis="{axis[0]} {axis[1]} {axis[2]}"/>'
            text += body(child) + "</body>"
        for child, _, xyz in tools:
            text += frame(child, xyz, np.eye(3)) + "</body>"
        return text

    def frame(name, xyz, r):
        p = np.array(xyz) + LENGTH * rng.normal(size=3)
        q = np.zeros(4)
        mujoco.mju_mat2Quat(q, (r @ turn(ANGLE * rng.normal(size=3))).flatten())
        place = " ".join(map(repr, map(float, p)))
        about = " ".join(map(repr, map(float, q)))
        inertial = '<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
        return f'<body name="{name}" pos="{place}" quat="{about}">{inertial}'

    return f'<mujoco><compiler angle="radian"/><worldbody>{body("base")}</worldbody></mujoco>'


class Arms:
    """Where the right tool is in the frame of the left one."""

    def __init__(self, model):
        self.model, self.data = model, mujoco.MjData(model)
        joint = lambda name: mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{name}_joint")
        self.order = [model.jnt_qposadr[joint(a[0])] for a in ARMS]
        self.tools = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, t[0]) for t in TOOLS]

    def grip(self, q):
        self.data.qpos[self.order] = q
        mujoco.mj_kinematics(self.model, self.data)
        (ra, pa), (rb, pb) = [
            (self.data.xmat[b].reshape(3, 3).copy(), self.data.xpos[b].copy()) for b in self.tools
        ]
        return ra.T @ rb, ra.T @ (pb - pa)

    def close(self, wanted, rng):
        """Readings with which the tools are so to one another."""
        def off(q):
            r, p = self.grip(q)
            return np.concatenate([p - wanted[1], vector(r @ wanted[0].T)])

        while True:
            q = rng.uniform(-1.2, 1.2, len(ARMS))
            for _ in range(60):
                e = off(q)
                if np.abs(e).max() < 1e-11 and np.abs(q).max() < LIMIT:
                    return q
                step = 1e-6 * np.eye(len(q))
                j = np.array([(off(q + h) - off(q - h)) / 2e-6 for h in step]).T
                # damped far from the solution
                d = -j.T @ np.linalg.solve(j @ j.T + 1e-3 * min(1.0, e @ e) * np.eye(6), e)
                q = q + d * min(1.0, 0.3 / np.abs(d).max())


def make(folder):
    rng = np.random.default_rng(1)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.urdf").write_text(urdf())
    (folder / "true.xml").write_text(mjcf(rng))
    arms = Arms(mujoco.MjModel.from_xml_path(str(folder / "true.xml")))
    held = drawn((3.0, 0.1, 0.2)), np.array([0.01, 0.02, 0.2])
    lines = [",".join(f"{a[0]}_joint" for a in ARMS) + ",use"]
    for k in range(FITTED + HELD_OUT):
        r, p = held
        if k < FITTED:  # what is held gives a little
            r, p = turn(NOISE[1] * rng.normal(size=3)) @ r, p + NOISE[0] * rng.normal(size=3)
        q = arms.close((r, p), rng)
        lines.append(",".join(map(repr, map(float, q))) + (",fit" if k < FITTED else ",holdout"))
    (folder / "loops.csv").write_text("\n".join(lines) + "\n")
    (folder / "calibration.toml").write_text(
        'robot = "robot.urdf"\nframe = "left"\nother = "right"\neffects = []\n\n[[measurement]]\nkind = "loop"\n'
        f'file = "loops.csv"\nstd = {NOISE[0]}\nangle_std = {NOISE[1]}\n\n[prior]\nlength = {LENGTH}\nangle = {ANGLE}\n'
    )
    print(f"wrote {FITTED + HELD_OUT} loops to {folder}")


def away(robot, poses):
    """Distances of the right tool from where it truly is, mm, the frames of both tools chosen so that they are small."""
    def residual(x):
        a, b = turn(x[3:6]), turn(x[9:12])
        out = []
        for (r, p), (rt, pt) in zip(robot, poses):
            out += [*(a @ (r @ x[6:9] + p) + x[:3] - pt), *(0.1 * vector(a @ r @ b @ rt.T))]
        return np.array(out)

    x = np.zeros(12)
    for _ in range(8):
        e = residual(x)
        j = np.array([(residual(x + h) - residual(x - h)) / 2e-6 for h in 1e-6 * np.eye(12)]).T
        x -= np.linalg.lstsq(j, e, rcond=None)[0]
    return 1e3 * np.linalg.norm(residual(x).reshape(-1, 6)[:, :3], axis=1)


def check(folder):
    rng = np.random.default_rng(2)
    load = lambda name: Arms(mujoco.MjModel.from_xml_path(str(folder / name)))
    true, file, found = load("true.xml"), load("robot.urdf"), load("calibrated/robot.urdf")
    rows = [line.split(",") for line in (folder / "loops.csv").read_text().splitlines()[1:]]
    loops = [np.array(r[:-1], float) for r in rows if r[-1] == "holdout"]
    free = list(rng.uniform(-1.2, 1.2, (200, len(ARMS))))
    show = lambda name, e: print(f"{name}: median {np.median(e):.3f} mm, 95 % {np.percentile(e, 95):.3f} mm, largest {e.max():.3f} mm")
    for name, arms in [("file", file), ("calibrated", found)]:
        grips = np.array([arms.grip(q)[1] for q in loops])
        show(f"{name}, loops held out", 1e3 * np.linalg.norm(grips - grips.mean(axis=0), axis=1))
        show(f"{name}, nothing held", away([arms.grip(q) for q in free], [true.grip(q) for q in free]))


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in ("make", "check"):
        sys.exit(__doc__)
    {"make": make, "check": check}[sys.argv[1]](Path(sys.argv[2]))
