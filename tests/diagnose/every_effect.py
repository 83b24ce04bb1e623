"""Logs of machines in MuJoCo that hide one effect each, and what is left of it with the files of a diagnosis.

    every_effect.py make FOLDER       writes FOLDER/EFFECT/{robot.urdf,robot.toml,experiment.toml,*.csv,holdout.npz}
    every_effect.py measure FOLDER    prints, of FOLDER/EFFECT/out, the effect and the share of the energy that is left

The effects stand here in formulas of their own; nothing of the files under test makes the logs.
"""
import functools
import importlib.util
import os
import sys

import mujoco
import numpy as np
from scipy.integrate import solve_ivp

RATE, NOISE = 250.0, 0.02
# s of motion before a record of what swings on springs begins
BEFORE = 3.0
NAMES = ["turn", "raise", "bend"]
FRICTION = {"viscous": [1.2, 1.5, 0.8], "coulomb": [2.0, 2.5, 1.2], "armature": [0.4, 0.5, 0.2]}
URDF = """<robot name="arm3"><link name="base"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/>
<limit lower="-3.1" upper="3.1" velocity="4" effort="200"/></joint>
<link name="a"><inertial><origin xyz="0.02 0.01 0.05"/><mass value="4"/>
<inertia ixx="0.04" iyy="0.05" izz="0.03" ixy="0" ixz="0.002" iyz="0"/></inertial></link>
<joint name="raise" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0.05 0.1"/><axis xyz="0 1 0"/>
<limit lower="-3.1" upper="3.1" velocity="4" effort="200"/></joint>
<link name="b"><inertial><origin xyz="0.01 0.02 0.2"/><mass value="5"/>
<inertia ixx="0.12" iyy="0.11" izz="0.02" ixy="0" ixz="0" iyz="0.004"/></inertial></link>
<joint name="bend" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/>
<limit lower="-3.1" upper="3.1" velocity="4" effort="200"/></joint>
<link name="c"><inertial><origin xyz="0.03 -0.02 0.15"/><mass value="3"/>
<inertia ixx="0.05" iyy="0.05" izz="0.01" ixy="0.001" ixz="0" iyz="0"/></inertial></link></robot>"""


def machine(change=None):
    """The bodies as MuJoCo reads them, without friction; `change` acts on the specification."""
    text = URDF.replace("</robot>", '<mujoco><compiler fusestatic="false"/></mujoco></robot>')
    spec = mujoco.MjSpec.from_string(text)
    for joint, armature in zip(spec.joints, FRICTION["armature"]):
        joint.armature = armature
    if change:
        change(spec)
    model = spec.compile()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT) | int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    return model


def bodies(model, q, dq, ddq):
    """Torque of the bodies and rotors along a motion."""
    data, out = mujoco.MjData(model), np.zeros_like(q)
    for i in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[i], dq[i], ddq[i]
        mujoco.mj_inverse(model, data)
        out[i] = data.qfrc_inverse
    return out


def friction(dq):
    return np.array(FRICTION["viscous"]) * dq + np.array(FRICTION["coulomb"]) * np.sign(dq)


def motion(seed, period, periods, top, more=()):
    """Positions, velocities and accelerations of a sum of harmonics."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(periods * period * RATE)) / RATE
    orders = np.r_[1:6, list(more)]
    w = 2 * np.pi / period * orders
    x = [np.zeros((len(t), 3)) for _ in range(3)]
    for j in range(3):
        a, phase = rng.normal(size=len(w)) / orders**0.7, rng.uniform(0, 2 * np.pi, len(w))
        speed = (w * a * np.cos(np.outer(t, w) + phase)).sum(1)
        a *= top[j] / np.abs(speed).max()
        angle = np.outer(t, w) + phase
        x[0][:, j] = [0.3, 0.7, -0.6][j] + (a * np.sin(angle)).sum(1)
        x[1][:, j] = (a * w * np.cos(angle)).sum(1)
        x[2][:, j] = -(a * w**2 * np.sin(angle)).sum(1)
    return t, *x


def moved(t, q, dq, ddq, j, way, rate, acceleration):
    """Torque where joint j stands by `way` beyond its encoder; friction and rotor are those of the motor."""
    q, dq, ddq, seen = q.copy(), dq.copy(), ddq.copy(), dq
    q[:, j] += way
    dq[:, j] += rate
    ddq[:, j] += acceleration
    tau = bodies(machine(), q, dq, ddq) + friction(seen)
    tau[:, j] -= FRICTION["armature"][j] * acceleration
    return tau


def on_spring(model, free, driven, spring, t, q, dq, ddq):
    """Torque of driven joints while others swing freely under `spring(x, v)`; Runge-Kutta of high order."""
    data, h = mujoco.MjData(model), t[1] - t[0]
    n = len(free)

    def at(s):
        i = min(int(s / h), len(t) - 2)
        w = s / h - i
        return [(1 - w) * x[i] + w * x[i + 1] for x in (q, dq, ddq)]

    def acceleration(s, x, v):
        a, b, c = at(s)
        data.qpos[driven], data.qvel[driven] = a, b
        data.qpos[free], data.qvel[free] = x, v
        base = np.zeros(model.nv)
        base[driven] = c
        data.qacc[:] = base
        mujoco.mj_inverse(model, data)
        force, mass = data.qfrc_inverse[free].copy(), np.zeros((n, n))
        for k in range(n):
            one, column = np.zeros(model.nv), np.zeros(model.nv)
            one[free[k]] = 1.0
            mujoco.mj_mulM(model, data, column, one)
            mass[:, k] = column[free]
        return np.linalg.solve(mass, spring(x, v) - force)

    # the motion repeats: at rest under a load of its end, then through that until it begins
    first = -min(int(BEFORE / h), len(t) - 1)
    settle = solve_ivp(lambda s, y: np.r_[y[n:], acceleration(t[first], y[:n], y[n:]) - 60.0 * y[n:]], (0, 3.0),
                       np.zeros(2 * n), rtol=1e-6, atol=1e-9).y[:n, -1]
    x, v = settle, np.zeros(n)
    out = np.zeros_like(q)
    for i in range(first, len(t)):
        c = acceleration(t[i], x, v)
        data.qpos[driven], data.qvel[driven], data.qacc[driven] = q[i], dq[i], ddq[i]
        data.qpos[free], data.qvel[free], data.qacc[free] = x, v, c
        mujoco.mj_inverse(model, data)
        out[i] = data.qfrc_inverse[driven]
        steps = 5
        g = h / steps
        for k in range(steps if i + 1 < len(t) else 0):
            s = t[i] + k * g
            # classic Runge-Kutta
            k1 = (v, acceleration(s, x, v))
            k2 = (v + g / 2 * k1[1], acceleration(s + g / 2, x + g / 2 * k1[0], v + g / 2 * k1[1]))
            k3 = (v + g / 2 * k2[1], acceleration(s + g / 2, x + g / 2 * k2[0], v + g / 2 * k2[1]))
            k4 = (v + g * k3[1], acceleration(s + g * 0.999, x + g * k3[0], v + g * k3[1]))
            x = x + g / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
            v = v + g / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
    return out + friction(dq)


def elastic(joint, stiffness, damping, gap=0.0):
    def change(spec):
        body = [b for b in spec.bodies if b.joints and b.joints[0].name == joint][0]
        body.add_joint(name="link_side", type=mujoco.mjtJoint.mjJNT_HINGE, axis=body.joints[0].axis)

    model = machine(change)
    free = [model.joint("link_side").dofadr[0]]
    driven = [model.joint(n).dofadr[0] for n in NAMES]

    def spring(x, v):
        beyond = x - np.clip(x, -gap / 2, gap / 2)
        force = -stiffness * beyond - damping * v * (beyond != 0 if gap else 1)
        return force if not gap else np.where(force * beyond < 0, force, 0.0)

    return lambda t, q, dq, ddq: on_spring(model, free, driven, spring, t, q, dq, ddq)


def soft_base(stiffness, damping):
    xml = machine_xml()
    head, tail = xml.split("<worldbody>")
    inside, rest = tail.rsplit("</worldbody>", 1)
    plate = ('<body name="plate"><inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
             '<joint name="about_x" axis="1 0 0"/><joint name="about_y" axis="0 1 0"/>')
    model = mujoco.MjModel.from_xml_string(f"{head}<worldbody>{plate}{inside}</body></worldbody>{rest}")
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT) | int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    free = [model.joint(n).dofadr[0] for n in ("about_x", "about_y")]
    driven = [model.joint(n).dofadr[0] for n in NAMES]
    spring = lambda x, v: -stiffness * x - damping * v
    return lambda t, q, dq, ddq: on_spring(model, free, driven, spring, t, q, dq, ddq)


def machine_xml():
    text = URDF.replace("</robot>", '<mujoco><compiler fusestatic="false"/></mujoco></robot>')
    spec = mujoco.MjSpec.from_string(text)
    for joint, armature in zip(spec.joints, FRICTION["armature"]):
        joint.armature = armature
    spec.compile()
    return spec.to_xml()


def added(f):
    """An effect that adds torque to one joint: `f(t, q, dq, ddq, torque of the bodies)` gives (joint, torque)."""

    def of(t, q, dq, ddq):
        rigid = bodies(machine(), q, dq, ddq)
        tau = rigid + friction(dq)
        for j, more in f(t, q, dq, ddq, rigid):
            tau[:, j] += more
        return tau

    return of


def changed(change):
    return lambda t, q, dq, ddq: bodies(machine(change), q, dq, ddq) + friction(dq)


def payload(spec):
    body = spec.body("c")
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0], mass=0.0)
    load, at = 0.8, np.array([0.05, 0.03, 0.32])
    m, c = body.mass, np.array(body.ipos)
    total = m + load
    centre = (m * c + load * at) / total
    tensor = np.zeros((3, 3))
    full = np.array(body.fullinertia)
    own = np.array([[full[0], full[3], full[4]], [full[3], full[1], full[5]], [full[4], full[5], full[2]]])
    if not np.isfinite(own).all():
        r = np.zeros(9)
        mujoco.mju_quat2Mat(r, np.array(body.iquat))
        r = r.reshape(3, 3)
        own = r @ np.diag(body.inertia) @ r.T
    for mass, at_, inertia in ((m, c, own), (load, at, 0.0)):
        d = at_ - centre
        tensor += inertia + mass * (d @ d * np.eye(3) - np.outer(d, d))
    body.mass, body.ipos = total, centre
    w, v = np.linalg.eigh(tensor)
    if np.linalg.det(v) < 0:
        v[:, 0] *= -1
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, v.ravel())
    body.iquat, body.inertia, body.fullinertia = quat, w, [np.nan] + [0] * 5


def heavier(spec):
    body = spec.body("b")
    body.mass *= 1.35
    body.inertia = np.array(body.inertia) * 1.35
    body.fullinertia = np.array(body.fullinertia) * 1.35


def tilted(spec):
    spec.option.gravity = [9.81 * np.sin(0.05), -9.81 * np.sin(0.04), -9.81 * np.cos(0.064)]


def delayed(t, q, dq, ddq):
    tau = bodies(machine(), q, dq, ddq) + friction(dq)
    # reported 6 ms before it acts
    return np.stack([np.interp(t + 0.006, t, tau[:, j]) for j in range(3)], 1)


def saturated(t, q, dq, ddq):
    tau = bodies(machine(), q, dq, ddq) + friction(dq)
    peak = 30.0
    tau[:, 1] *= 1 + 0.25 * (np.abs(tau[:, 1]) / peak) ** 2
    return tau


@functools.cache
def largest():
    """Largest torque of the second joint over all records."""
    motions = (motion(seed, period, periods, top) for _, seed, period, periods, top in RECORDS)
    return max(np.abs((bodies(machine(), *x[1:]) + friction(x[2]))[:, 1]).max() for x in motions)


def limited(t, q, dq, ddq):
    """A drive that makes no more than its limit, which the largest torque nearly is."""
    tau = bodies(machine(), q, dq, ddq) + friction(dq)
    limit = 1.002 * largest()
    tau[:, 1] = limit * np.arctanh(tau[:, 1] / limit)
    return tau


def scaled(t, q, dq, ddq):
    tau = bodies(machine(), q, dq, ddq) + friction(dq)
    tau[:, 1] *= 1.12
    return tau


def hysteresis(t, q, dq, ddq):
    """Dahl's friction in place of the sign on one joint, over the way."""
    tau = bodies(machine(), q, dq, ddq) + friction(dq)
    level, reach, z = FRICTION["coulomb"][1] * 1.6, 0.03, 0.0
    more = np.zeros(len(t))
    for i in range(len(t)):
        d = q[i, 1] - q[max(i - 1, 0), 1]
        for _ in range(20):
            z += d / 20 / reach * (1 - z * np.sign(d))
        more[i] = level * (z - np.sign(dq[i, 1]))
    tau[:, 1] += more
    return tau


def warm(t, q, dq, ddq):
    tau = bodies(machine(), q, dq, ddq) + friction(dq)
    heat, loss = 0.0, np.zeros(len(t))
    for i in range(len(t)):
        heat += (t[1] - t[0]) / 8.0 * (np.abs(dq[i, 1]) / 1.5 - heat)
        loss[i] = 0.7 * heat
    tau[:, 1] -= loss * friction(dq)[:, 1]
    return tau


def wave(order, amplitude, phase):
    def of(t, q, dq, ddq):
        x, v, a = q[:, 1], dq[:, 1], ddq[:, 1]
        s, c = np.sin(order * x + phase), np.cos(order * x + phase)
        way = amplitude * s
        return moved(t, q, dq, ddq, 1, way, amplitude * order * c * v,
                     amplitude * order * (c * a - order * s * v * v))
    return of


def offset(t, q, dq, ddq):
    one = np.ones(len(t))
    return moved(t, q, dq, ddq, 1, 0.04 * one, 0 * one, 0 * one)


def sharp(v):
    return np.sign(v)


EFFECTS = {
    "payload": changed(payload),
    "link_inertia": changed(heavier),
    "gravity_direction": changed(tilted),
    "rotor_inertia": added(lambda t, q, dq, ddq, r: [(1, 0.6 * ddq[:, 1])]),
    "viscous_friction": added(lambda t, q, dq, ddq, r: [(1, 2.0 * dq[:, 1])]),
    "coulomb_friction": added(lambda t, q, dq, ddq, r: [(1, 2.0 * sharp(dq[:, 1]))]),
    "torque_offset": added(lambda t, q, dq, ddq, r: [(1, 1.5 + 0 * t)]),
    "friction_asymmetry": added(lambda t, q, dq, ddq, r: [(1, np.where(dq[:, 1] > 0, 1.4, 0.2) * dq[:, 1])]),
    "nonlinear_viscous_friction": added(lambda t, q, dq, ddq, r: [(1, 1.5 * dq[:, 1] * np.abs(dq[:, 1]))]),
    "stribeck_friction": added(
        lambda t, q, dq, ddq, r: [(1, 3.0 * np.exp(-((dq[:, 1] / 0.12) ** 2)) * sharp(dq[:, 1]))]),
    "presliding_hysteresis": hysteresis,
    "load_dependent_friction": added(
        lambda t, q, dq, ddq, r: [(1, 0.25 * np.abs(r[:, 1]) * sharp(dq[:, 1]))]),
    "position_dependent_friction": added(
        lambda t, q, dq, ddq, r: [(1, 1.5 * np.sin(3 * q[:, 1] + 0.7) * sharp(dq[:, 1]))]),
    "thermal_friction": warm,
    "torque_constant": scaled,
    "torque_saturation": saturated,
    "torque_at_its_limit": limited,
    "cogging": added(lambda t, q, dq, ddq, r: [(1, 1.2 * np.sin(50 * q[:, 1] + 0.4))]),
    "transmission_error": wave(50.0, 4e-4, 0.3),
    "joint_elasticity": elastic("raise", 2000.0, 6.0),
    "backlash": elastic("raise", 6000.0, 40.0, gap=0.004),
    "base_compliance": soft_base(2500.0, 30.0),
    "torque_delay": delayed,
    "cable_spring": added(lambda t, q, dq, ddq, r: [(1, 6.0 * (q[:, 1] - 0.1) + 1.5 * (q[:, 1] - 0.5) ** 3)]),
    "counterbalance": added(
        lambda t, q, dq, ddq, r: [(1, -9.0 * np.sin(q[:, 1] - 0.2) + 1.5 * np.sin(2 * q[:, 1]))]),
    "joint_coupling": added(lambda t, q, dq, ddq, r: [
        (j, 1.5 * sharp(dq[:, 1] + dq[:, 2]) + 0.8 * (dq[:, 1] + dq[:, 2]) + 0.2 * (ddq[:, 1] + ddq[:, 2]))
        for j in (1, 2)]),
    "joint_offset": offset,
    "encoder_eccentricity": wave(1.0, 0.03, 0.5),
}
# effects whose joint has no such term in the nominal model
MISSING = {"rotor_inertia": "armature", "viscous_friction": "viscous", "coulomb_friction": "coulomb",
           "torque_offset": "offset"}
# effects that show where the motion is quick
QUICK = ["joint_elasticity", "backlash", "base_compliance"]
RECORDS = [("fit_1", 1, 8.0, 2, [2.0, 1.6, 2.4]), ("fit_2", 2, 16.0, 2, [0.6, 0.5, 0.7]),
           ("fit_3", 3, 12.0, 2, [1.4, 1.2, 1.6]), ("holdout", 4, 10.0, 1, [1.7, 1.4, 2.0])]


def make(folder, only):
    for name, effect in EFFECTS.items():
        # what swings on springs takes a while to integrate: only where it is named
        if name not in only if only else name in QUICK:
            continue
        here = os.path.join(folder, name)
        os.makedirs(here, exist_ok=True)
        open(f"{here}/robot.urdf", "w").write(URDF)
        robot = 'name = "arm3"\nurdf = "robot.urdf"\nprior = "identified"\n'
        for j, joint in enumerate(NAMES):
            unknown = [k for k in ("armature", "viscous", "coulomb", "offset")
                       if not (j == 1 and MISSING.get(name) == k)]
            robot += f'[[joint]]\nname = "{joint}"\ntorque_noise = {NOISE}\nposition_resolution = 1e-6\n'
            robot += "gear_ratio = 50\n" if name in ("cogging", "transmission_error") else ""
            for k in ("armature", "viscous", "coulomb"):
                robot += f"{k} = {FRICTION[k][j]}\n"
            robot += f"identify = {unknown}\n".replace("'", '"')
        open(f"{here}/robot.toml", "w").write(robot)
        experiment = 'robot = "robot.toml"\n'
        rng = np.random.default_rng(7)
        for record, seed, period, periods, top in RECORDS:
            if name in QUICK and record == "holdout":
                # as quick as the quickest that is fitted, or there is no gap
                period, top = RECORDS[0][2], RECORDS[0][4]
            if name == "thermal_friction":
                periods *= 5
            t, q, dq, ddq = motion(seed, period, periods, top, (9, 14, 20) if name in QUICK else ())
            tau = effect(t, q, dq, ddq)
            if record == "holdout":
                np.savez(f"{here}/holdout.npz", t=t, q=q, dq=dq, ddq=ddq, tau=tau)
            rows = np.c_[t, q + rng.normal(0, 1e-6, q.shape), tau + rng.normal(0, NOISE, tau.shape)]
            head = "t," + ",".join(f"{c}{j + 1}" for c in ("q", "tau") for j in range(3))
            np.savetxt(f"{here}/{record}.csv", rows, "%.9g", ",", header=head, comments="")
            use = "holdout" if record == "holdout" else "fit"
            experiment += f'[[record]]\nlog = "{record}.csv"\nuse = "{use}"\n'
            experiment += f"period = {period}\n" if name != "thermal_friction" else ""
        open(f"{here}/experiment.toml", "w").write(experiment)


def measure(folder, only):
    for name in EFFECTS:
        out = os.path.join(folder, name, "out")
        if (only and name not in only) or not os.path.isdir(out):
            continue
        x = np.load(os.path.join(folder, name, "holdout.npz"))
        t, q, dq, ddq, tau = (x[k] for k in ("t", "q", "dq", "ddq", "tau"))
        model = mujoco.MjModel.from_xml_path(f"{out}/robot.xml")
        if os.path.exists(f"{out}/effects.py"):
            spec = importlib.util.spec_from_file_location(name, f"{out}/effects.py")
            effects = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(effects)
            # the actuators have gains and delays themselves
            drives = [drive for drive in effects.DRIVES if not drive[2]]
            for far in (1.0, 10.0):
                # what is told is reported again, far beyond what was seen as well
                again = effects.told_by(drives, effects.command(far * tau), np)
                assert np.allclose(again, far * tau, rtol=1e-6, atol=1e-6), f"{name}: the command of a torque"
            ours = effects.inverse(model, q, dq, ddq, t[1] - t[0])
        else:
            model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
            ours = bodies(model, q, dq, ddq)
        nominal = bodies(machine(), q, dq, ddq) + friction(dq)
        gap, left = ((tau - nominal) ** 2).sum(), ((tau - ours) ** 2).sum()
        print(name, left / gap, flush=True)


if __name__ == "__main__":
    {"make": make, "measure": measure}[sys.argv[1]](sys.argv[2], sys.argv[3:])
