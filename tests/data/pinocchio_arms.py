"""Arms of other makers in Pinocchio, under control: what does `excite diagnose` say of their logs?

    python3 tests/data/pinocchio_arms.py --excite target/release/excite --arms 32 --seed 1 --output target/pinocchio_arms

takes the public files of six arms (UR5, Panda, Talos, xArm7, Z1, Jaco), hides one effect in each (or none) in a formula of its
own, and lets a controller of the nominal model follow four motions; forward dynamics are Pinocchio's. A joint may have a motor and a
link of its own with a spring, a dead band or an uneven gear between them, and a base may sway. Logs have 125 to 1000 Hz, encoders of
14 to 20 bits, torques at an instant or as a mean, and noise; there are no velocities in them. Prints what was named, and how
often that was right. Needs numpy, pin and example-robot-data.
"""

import re
from pathlib import Path

import arms
import numpy as np
import pinocchio as pin

#: files in the package example-robot-data, and which joints are held
ROBOTS = {
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "^$"),
    "panda": ("panda_description/urdf/panda.urdf", "finger"),
    "talos": ("talos_data/robots/talos_left_arm.urdf", "gripper"),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", "finger|knuckle|drive"),
    "z1": ("z1_description/urdf/z1.urdf", "[Gg]ripper"),
    "jaco": ("kinova_description/robots/kinova.urdf", "finger"),
}
EFFECTS = [
    "none", "joint_elasticity", "backlash", "transmission_error", "joint_offset", "encoder_eccentricity", "gravity_direction",
    "base_compliance", "position_dependent_friction", "thermal_friction", "counterbalance", "rotor_inertia", "link_inertia",
    "none", "payload", "stribeck_friction", "presliding_hysteresis", "cogging", "torque_constant", "torque_delay", "cable_spring",
    "load_dependent_friction", "friction_asymmetry", "nonlinear_viscous_friction", "torque_saturation", "coulomb_friction",
    "viscous_friction", "torque_offset", "push", "bursts", "rattle", "none",
]  # fmt: skip
#: what no name of the catalogue is
OUTSIDE = {"push", "bursts", "rattle"}
#: what only shows against an identified model
IDENTIFIED = {
    "payload", "joint_offset", "gravity_direction", "link_inertia", "rotor_inertia", "counterbalance", "coulomb_friction",
    "viscous_friction", "torque_offset", "torque_constant",
}  # fmt: skip
#: frequency of the spring between motor and link, Hz
SPRINGS = {"joint_elasticity": 9.0, "backlash": 40.0, "transmission_error": 35.0}
#: name, seed, period (s), periods, share of the top speed
RECORDS = [("fit_1", 1, 8.0, 2, 0.9), ("fit_2", 2, 14.0, 2, 0.3), ("fit_3", 3, 10.0, 2, 0.6), ("holdout", 4, 9.0, 2, 0.75)]
GEAR, BEFORE, CONTROL, GAP = 100.0, 2.0, 0.001, 0.004


def file_of(robot):
    return Path(pin.__file__).parents[4] / "share/example-robot-data/robots" / ROBOTS[robot][0]


def with_plain_angles(model):
    """The model with one coordinate for each joint, also those that turn without an end."""
    out, turn = pin.Model(), {"X": pin.JointModelRX, "Y": pin.JointModelRY, "Z": pin.JointModelRZ}
    out.gravity = model.gravity
    for j in range(1, model.njoints):
        joint = model.joints[j]
        v, endless = joint.idx_v, joint.nq != joint.nv
        low, high = ([-3.0], [3.0]) if endless else ([x[joint.idx_q]] for x in (model.lowerPositionLimit, model.upperPositionLimit))
        kind = turn[joint.shortname()[-1]]() if endless else joint
        limits = model.effortLimit[v : v + 1], model.velocityLimit[v : v + 1], np.array(low), np.array(high)
        k = out.addJoint(model.parents[j], kind, model.jointPlacements[j], model.names[j], *limits)
        out.appendBodyToJoint(k, model.inertias[j], pin.SE3.Identity())
    return out


def on_swaying_base(arm):
    """The arm on two joints of a base that weighs half as much."""
    base, mass = pin.Model(), 0.5 * sum(i.mass for i in arm.inertias)
    base.gravity = arm.gravity
    a = base.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "sway_x")
    b = base.addJoint(a, pin.JointModelRY(), pin.SE3.Identity(), "sway_y")
    base.appendBodyToJoint(b, pin.Inertia(mass, np.zeros(3), np.eye(3) * 0.04 * mass), pin.SE3.Identity())
    mount = base.addFrame(pin.Frame("mount", b, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    return pin.appendModel(base, arm, mount, pin.SE3.Identity())


class Machine:
    """One arm, its nominal model, and what is hidden in it."""

    def __init__(self, seed, number, robot=None):
        rng = np.random.default_rng([seed, number, 77])
        self.key = seed, number
        self.robot = robot or list(ROBOTS)[(number + seed) % len(ROBOTS)]
        self.effect = e = EFFECTS[number % len(EFFECTS)]
        full = pin.buildModelFromUrdf(str(file_of(self.robot)))
        held = [j for j in range(1, full.njoints) if re.search(ROBOTS[self.robot][1], full.names[j])]
        self.held = [full.names[j] for j in held]
        self.nominal = with_plain_angles(pin.buildReducedModel(full, held, pin.neutral(full)))
        n = self.n = self.nominal.nv
        self.names = [self.nominal.names[j] for j in range(1, n + 1)]
        low, high = np.clip(self.nominal.lowerPositionLimit, -3, 3), np.clip(self.nominal.upperPositionLimit, -3, 3)
        self.middle = 0.5 * (low + high) + 0.05 * (high - low) * rng.normal(size=n)
        self.half = np.minimum(0.4 * (high - low), 1.3)
        v = self.nominal.velocityLimit
        self.top = np.minimum(np.where((v > 0) & (v < 50), v, 2.0), 2.2) * 0.8
        self.bits, self.rate = int(rng.choice([14, 17, 20])), int(rng.choice([125, 250, 500, 1000]))
        self.inertia = np.diag(pin.crba(self.nominal, self.nominal.createData(), self.middle)).copy()
        self.scale = self.peaks(rng)
        self.rotor = self.inertia * rng.uniform(0.2, 0.7, n) + 0.01 * self.scale / self.top
        self.coulomb, self.viscous = self.scale * rng.uniform(0.04, 0.12, n), self.scale / self.top * rng.uniform(0.03, 0.1, n)
        self.noise = self.scale * rng.choice([0.002, 0.004, 0.008])
        joints = {"joint_offset": (1, 2), "counterbalance": (1, 2), "joint_elasticity": (0, 3)}
        joints |= dict.fromkeys(("transmission_error", "encoder_eccentricity", "link_inertia"), (1, 3))
        j = self.joint = int(rng.integers(*joints.get(e, (0, n))))
        self.close = e in IDENTIFIED or bool(rng.random() < 0.4)
        #: half steps of the control, in samples of the log, over which a torque is a mean
        self.window = int(rng.choice([0, 1, 2]))
        off = (0.003, 0.003, 0.003) if self.close else (0.06, 0.2, 0.1)
        self.true = self.nominal.copy()
        for k in range(1, n + 1):
            body = self.nominal.inertias[k]
            m, i = body.mass * np.exp(off[0] * rng.normal()), body.inertia * np.exp(off[0] * rng.normal())
            self.true.inertias[k] = pin.Inertia(m, body.lever * (1 + off[0] * rng.normal(size=3)), i)
        told = [x * np.exp(s * rng.normal(size=n)) for x, s in zip((self.rotor, self.coulomb, self.viscous), (off[2], off[1], off[1]))]
        self.told_rotor, self.told_coulomb, self.told_viscous = told
        self.warmth = self.bristle = self.burst = 0.0
        self.change(j)

    def peaks(self, rng):
        """Largest torques of the nominal model."""
        data, peak = self.nominal.createData(), np.zeros(self.n)
        for _ in range(200):
            q, v, a = (c + h * rng.uniform(-1, 1, self.n) for c, h in ((self.middle, self.half), (0, self.top), (0, 3 * self.top)))
            peak = np.maximum(peak, np.abs(pin.rnea(self.nominal, data, q, v, a)))
        return np.maximum(peak, 0.015 * peak.max())

    def change(self, j):
        """What of the effect lives in the bodies and joints of the machine."""
        e, s, true, n = self.effect, self.scale[j], self.true, self.n
        if e == "payload":
            m = 0.25 * (true.inertias[n - 1].mass + true.inertias[n].mass) + 0.3
            load = pin.Inertia(m, np.array([0.02, 0.03, 0.08]), np.eye(3) * m * 1e-3)
            true.inertias[n] = true.inertias[n] + load
        if e == "link_inertia":
            body = true.inertias[j + 1]
            true.inertias[j + 1] = pin.Inertia(1.3 * body.mass, body.lever + np.array([0.03, -0.02, 0.02]), 1.5 * body.inertia)
        if e == "gravity_direction":
            true.gravity.linear = pin.utils.rotate("x", 0.035) @ pin.utils.rotate("y", -0.02) @ true.gravity.linear
        self.rotor[j] += (e == "rotor_inertia") * 0.35 * (self.inertia[j] + self.rotor[j])
        self.coulomb[j] += (e == "coulomb_friction") * 0.12 * s
        self.viscous[j] += (e == "viscous_friction") * 0.12 * s / self.top[j]
        rotors = self.rotor.copy()
        if e in SPRINGS:
            rotors[j] = 0.0
            both = self.inertia[j] * self.rotor[j] / (self.inertia[j] + self.rotor[j])
            self.stiffness = (2 * np.pi * SPRINGS[e]) ** 2 * (self.inertia[j] if e == "joint_elasticity" else both)
            self.damping = 0.16 * np.sqrt(self.stiffness * both)
        if e == "base_compliance":
            self.true, rotors = on_swaying_base(true), np.concatenate([np.zeros(2), rotors])
        self.true.armature = rotors

    def hidden(self, q, v, u, step):
        """Torque of the effect on its joint."""
        e, j = self.effect, self.joint
        q, v, u, s, top = q[j], v[j], u[j], self.scale[j], self.top[j]
        sharp, way = np.tanh(v / (0.002 * top)), v * step
        if e == "presliding_hysteresis":
            # Bouc and Wen
            self.bristle += way / 0.02 * (1 - self.bristle**2 * (0.5 + 0.5 * np.sign(way * self.bristle)))
        if e == "thermal_friction":
            self.warmth = min(1.0, self.warmth + step / 45.0 * (abs(v) / (0.35 * top) - self.warmth))
        a, b, angle = 0.35, 0.12, q + 0.2
        long = np.sqrt(a * a + b * b - 2 * a * b * np.cos(angle))
        return {
            "position_dependent_friction": lambda: -0.09 * s * np.sin(q + 0.6) * sharp,
            "thermal_friction": lambda: self.warmth * (0.6 * self.coulomb[j] * sharp + 0.5 * self.viscous[j] * v),
            "counterbalance": lambda: -0.5 * s * (long - 0.22) / long * np.sin(angle),
            "cogging": lambda: 0.05 * s * np.sin(GEAR * q + 0.4),
            "stribeck_friction": lambda: -0.1 * s * np.exp(-abs(v / (0.06 * top))) * sharp,
            "cable_spring": lambda: -s * (0.12 * (q - self.middle[j] - 0.2) + 0.05 * (q - self.middle[j]) ** 3),
            "load_dependent_friction": lambda: -0.12 * abs(u) * sharp,
            "friction_asymmetry": lambda: -float(v > 0) * s * (0.1 * sharp + 0.05 * v / top),
            "nonlinear_viscous_friction": lambda: -0.15 * s * v * abs(v) / top**2,
            "torque_offset": lambda: -0.08 * s,
            "torque_saturation": lambda: -0.25 * u * abs(u) / s,
            "presliding_hysteresis": lambda: -0.12 * s * self.bristle,
            "bursts": lambda: 0.25 * s * self.burst,
            "rattle": lambda: 0.08 * s * self.burst * np.sign(q - self.middle[j]),
        }.get(e, lambda: 0.0)()

    def link(self, motor, link):
        """Torque of the gear from the position and velocity of the motor and of the link."""
        twist = motor[0] - link[0]
        if self.effect == "backlash":
            twist = np.sign(twist) * max(0.0, abs(twist) - 0.5 * GAP)
        if self.effect == "transmission_error":
            twist += 0.0006 * np.sin(0.2 * GEAR * motor[0] + 0.3)
        return self.stiffness * twist + self.damping * (motor[1] - link[1]) * (twist != 0)

    def accelerations(self, data, t, x, dx, tau):
        """Of all joints, a base that sways first; somebody pushes the tool now and then."""
        if self.effect == "base_compliance":
            stiffness = self.scale.max() / 0.004
            tau = np.concatenate([-stiffness * (x[:2] + 0.001 * dx[:2]), tau])
        if self.effect != "push" or not 3.0 < t % 7.3 < 4.2:
            return pin.aba(self.true, data, x, dx, tau)
        pin.forwardKinematics(self.true, data, x)
        forces = pin.StdVec_Force()
        forces.extend([pin.Force.Zero()] * self.true.njoints)
        push = np.array([0.5, -0.4, 0.6]) * 0.15 * self.scale.max()
        forces[self.n] = pin.Force(data.oMi[self.n].rotation.T @ push, np.zeros(3))
        return pin.aba(self.true, data, x, dx, tau, forces)

    def run(self, seed, period, periods, fast):
        """Positions that the encoders would read, and torques that the motors are told, at every half step of the control."""
        rng = np.random.default_rng([seed, *self.key])
        orders = np.arange(1, 6)
        w = 2 * np.pi / period * orders
        a, phase = rng.normal(size=(self.n, 5)) / orders**0.6, rng.uniform(0, 2 * np.pi, (self.n, 5))
        angles = np.linspace(0, period, 500)[:, None, None] * w + phase
        speed, way = (np.abs((a * x).sum(-1)).max(0) for x in (w * np.cos(angles), np.sin(angles)))
        a *= np.minimum(fast * self.top / speed, self.half / way)[:, None]

        def desired(t):
            sine, cosine = np.sin(w * t + phase), np.cos(w * t + phase)
            return self.middle + (a * sine).sum(1), (a * w * cosine).sum(1), -(a * w**2 * sine).sum(1)

        j, e = self.joint, self.effect
        soft, sways = e in SPRINGS, 2 * (e == "base_compliance")
        step = 0.000125 if soft or sways else 0.0005
        told, data = self.nominal.createData(), self.true.createData()
        x, dx = (np.concatenate([np.zeros(sways), s]) for s in desired(-BEFORE)[:2])
        motor = np.array([x[sways + j], dx[sways + j]])
        mass, bandwidth, tick = self.told_rotor + 0.5 * self.inertia, 2 * np.pi * 6, 2 * np.pi / 2**self.bits
        seen, torques = [], []
        for k in range(int((periods * period + BEFORE) / CONTROL) + 1):
            t = k * CONTROL - BEFORE
            wanted = desired(t)
            q, v = x[sways:].copy(), dx[sways:].copy()
            if soft:
                q[j], v[j] = motor
            u = pin.rnea(self.nominal, told, *wanted) + self.told_rotor * wanted[2] + self.told_viscous * wanted[1]
            u += self.told_coulomb * np.tanh(wanted[1] / (0.01 * self.top))
            u += mass * (bandwidth**2 * (wanted[0] - np.round(q / tick) * tick) + 1.4 * bandwidth * (wanted[1] - v))
            if k % 150 == 0:
                self.burst = rng.normal() * (rng.random() < 0.4)
            for i in range(round(CONTROL / step)):
                q, v = x[sways:].copy(), dx[sways:].copy()
                if soft:
                    q[j], v[j] = motor
                if i % round(0.5 * CONTROL / step) == 0 and t > -1e-9:
                    reads = q.copy()
                    reads[j] += (e == "joint_offset") * 0.02 + (e == "encoder_eccentricity") * 0.006 * np.sin(q[j] + 0.7)
                    seen.append(reads)
                    torques.append(u)
                tau = u - self.coulomb * np.tanh(v / (0.002 * self.top)) - self.viscous * v
                tau[j] += self.hidden(q, v, u, step)
                if soft:
                    through = self.link(motor, (x[j], dx[j]))
                    motor[1] += step * (tau[j] - through) / self.rotor[j]
                    motor[0] += step * motor[1]
                    tau[j] = through
                dx = dx + step * self.accelerations(data, t, x, dx, tau)
                x = x + step * dx
        return np.array(seen), np.array(torques)

    def log(self, seed, period, periods, fast):
        """Columns of a log."""
        self.warmth *= 0.8
        q, tau = self.run(seed, period, periods, fast)
        t, every, rng = 0.5 * CONTROL * np.arange(len(q)), round(2 / (self.rate * CONTROL)), np.random.default_rng([9, seed, self.key[1]])
        if self.effect == "torque_delay":
            tau = np.stack([np.interp(t - 0.004, t, x) for x in tau.T], 1)
        if self.effect == "torque_constant":
            tau[:, self.joint] *= 1.1
        # the mean of as many half steps before the row as after it
        w, rows = max(1, self.window * every // 2), np.arange(len(tau))
        sums = np.cumsum(np.vstack([np.zeros(self.n), tau]), 0)
        first, last = np.maximum(rows - w, 0), np.minimum(rows + w, len(tau))
        tau = ((sums[last] - sums[first]) / (last - first)[:, None])[::every]
        tick = 2 * np.pi / 2**self.bits
        return np.c_[t[::every], np.round(q[::every] / tick) * tick, tau + self.noise * rng.normal(size=tau.shape)]

    def write(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        held = ", ".join(f"{name} = 0.0" for name in self.held)
        robot = f'name = "{self.robot}"\nurdf = "{file_of(self.robot)}"\nprior = "{"identified" if self.close else "cad"}"\nlock = {{ {held} }}\n'
        for j, name in enumerate(self.names):
            numbers = {
                "velocity": 1.5 * self.top[j], "acceleration": 60.0, "effort": 6 * self.scale[j], "torque_noise": self.noise[j],
                "position_resolution": 2 * np.pi / 2**self.bits, "armature": self.told_rotor[j], "viscous": self.told_viscous[j],
                "coulomb": self.told_coulomb[j],
            }  # fmt: skip
            gear = {"cogging": GEAR, "transmission_error": 0.1 * GEAR}.get(self.effect)
            robot += f'[[joint]]\nname = "{name}"\nposition = [-12.0, 12.0]\nidentify = ["armature", "viscous", "coulomb", "offset"]\n'
            robot += "".join(f"{key} = {float(x)!r}\n" for key, x in (numbers | ({"gear_ratio": gear} if gear else {})).items())
        (folder / "robot.toml").write_text(robot)
        names, experiment = ",".join(["t"] + [f"{c}{j + 1}" for c in ("q", "tau") for j in range(self.n)]), 'robot = "robot.toml"\n'
        for name, seed, period, periods, fast in RECORDS:
            np.savetxt(folder / f"{name}.csv", self.log(seed, period, periods, fast), "%.8g", ",", header=names, comments="")
            experiment += f'[[record]]\nlog = "{name}.csv"\nuse = "{"holdout" if name == "holdout" else "fit"}"\nperiod = {period}\n'
        (folder / "experiment.toml").write_text(experiment)

    def right(self, effect, joints):
        """Whether a name is that of what is hidden; those of one formula may stand for each other."""
        same = {"counterbalance": "cable_spring", "transmission_error": "cogging"}
        whole = effect in ("payload", "torque_delay", "gravity_direction", "base_compliance", "link_inertia")
        return effect in (self.effect, same.get(self.effect)) and (whole or self.names[self.joint] in joints)

    def told(self):
        return (
            f"{self.robot}, {self.bits} bits, {self.rate} Hz, {'identified' if self.close else 'cad'}: "
            f"{self.effect} ({self.names[self.joint]})"
        )


def case(job):
    """What was named on one arm."""
    number, asked = job
    machine, folder = Machine(asked.seed, number, asked.robot), asked.output / f"arm_{number:03d}"
    machine.write(folder)
    return arms.diagnosed(machine, folder, asked)


def main():
    parser = arms.options(len(EFFECTS), "target/pinocchio_arms")
    parser.add_argument("--robot", choices=ROBOTS, help="one robot instead of each in turn")
    arms.count(case, parser.parse_args(), OUTSIDE)


if __name__ == "__main__":
    main()
