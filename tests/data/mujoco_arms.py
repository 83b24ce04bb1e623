"""Random arms in MuJoCo under control: what does `excite diagnose` say of plain logs of a simulator?

    python3 tests/data/mujoco_arms.py --excite target/release/excite --arms 34 --seed 1 --output target/mujoco_arms

makes arms of four kinds (hobby, light, cobot, industrial; 3 to 7 joints) with MuJoCo's own damping, dry friction and
rotors, hides one effect in each (or none) in a formula of its own, and lets a controller of the nominal model follow four
motions. Logs have 200 to 1000 Hz, encoders of 12 to 20 bits, torques at an instant or averaged, and noise; there are
no velocities in them. The robot file is off as one from CAD is, or close as an identified one. Prints what was named, and how
often that was right. Needs numpy and mujoco.
"""

import arms
import mujoco
import numpy as np

EFFECTS = [
    "none",
    "none",
    "torque_delay",
    "delay_of_one_joint",
    "cogging",
    "stribeck_friction",
    "friction_asymmetry",
    "cable_spring",
    "torque_constant",
    "payload",
    "joint_coupling",
    "presliding_hysteresis",
    "load_dependent_friction",
    "nonlinear_viscous_friction",
    "outside",
    "stribeck_friction and torque_delay",
    "cogging and payload",
]
#: what every arm has, and what files but the first of the following leave out, or do not list to be identified
FRICTION = ["viscous_friction", "coulomb_friction", "torque_offset"]
#: what robot files state of Coulomb and of viscous friction, and whether they list it
FILES = {
    "full": (True, True, True),
    "stated": (True, True, False),
    "coulomb": (True, False, False),
    "viscous": (False, True, False),
    "listed": (False, False, True),
    "bare": (False, False, False),
}
#: name, seed, period (s), periods, share of the top speed
RECORDS = [("fit_1", 1, 8.0, 2, 0.9), ("fit_2", 2, 12.0, 2, 0.36), ("fit_3", 3, 10.0, 2, 0.63), ("holdout", 4, 8.0, 1, 0.77)]
#: length of a link (m), mass of the first (kg), top speed (rad/s), joints
KINDS = {
    "hobby": (0.1, 0.06, 3.0, (4, 7)),
    "light": (0.18, 0.6, 2.5, (5, 8)),
    "cobot": (0.28, 3.0, 1.8, (6, 8)),
    "industrial": (0.5, 30.0, 1.6, (5, 7)),
}
AXES = ["0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0", "0 1 0"]
GEAR, DELAY, STEP, CONTROL, BEFORE = 100.0, 0.006, 0.0005, 0.002, 3.0


def words(x):
    return " ".join(repr(float(v)) for v in np.ravel(x))


def arm(rng, hobby):
    """A kind, and its links: mass, way to the next, centre of mass, moments."""
    kind = "hobby" if hobby else str(rng.choice(list(KINDS)))
    length, mass, _, joints = KINDS[kind]
    links = []
    for j in range(int(rng.integers(*joints))):
        far = length * rng.uniform(0.5, 1.2) * (1.0 if j in (1, 2) else 0.5)
        way = np.array([(0, 0, far), (0, 0, far), (0.4 * far, 0, 0.6 * far)][j] if j < 3 else (far, 0, 0))
        m = mass * 0.75**j * rng.uniform(0.6, 1.4)
        box = 0.5 * np.abs(way) + 0.15 * far + 0.02 * length
        centre = way * rng.uniform(0.35, 0.6) + rng.normal(size=3) * 0.08 * far
        links.append({"m": m, "way": way, "com": centre, "moments": m / 3 * (np.sum(box**2) - box**2)})
    return kind, links


def mjcf(links, friction, limits, load=""):
    out = '<mujoco model="arm"><compiler angle="radian"/><option timestep="0.001" integrator="implicitfast"/><worldbody>\n'
    at = np.array([0, 0, 0.1])
    for j, link in enumerate(links):
        coulomb, viscous, rotor = (float(x[j]) for x in friction)
        out += (
            f'<body name="link{j + 1}" pos="{words(at)}"><inertial pos="{words(link["com"])}" mass="{float(link["m"])!r}" '
            f'diaginertia="{words(link["moments"])}"/><joint name="joint{j + 1}" axis="{AXES[j]}" range="-2.9 2.9" '
            f'armature="{rotor!r}" damping="{viscous!r}" frictionloss="{coulomb!r}"/>\n'
        )
        at = link["way"]
    out += load + "</body>" * len(links) + "</worldbody><actuator>"
    for j, limit in enumerate(limits):
        out += f'<motor name="m{j + 1}" joint="joint{j + 1}" forcerange="{-float(limit)!r} {float(limit)!r}"/>'
    return out + "</actuator></mujoco>\n"


def compiled(text):
    model = mujoco.MjModel.from_xml_string(text)
    bits = mujoco.mjtDisableBit
    model.opt.disableflags |= int(bits.mjDSBL_CONTACT) | int(bits.mjDSBL_LIMIT)
    model.opt.timestep = STEP
    return model


class Machine:
    """One arm, its nominal model, and what is hidden in it."""

    def __init__(self, seed, number, hobby=False):
        rng = self.rng = np.random.default_rng([seed, number])
        self.kind, self.links = arm(rng, hobby)
        self.effect = EFFECTS[number % len(EFFECTS)]
        n = self.n = len(self.links)
        self.top = KINDS[self.kind][2]
        beyond = [self.beyond(j) for j in range(n)]
        self.inertia = np.array([sum(m * r**2 for m, r in b) for b in beyond])
        weight = np.array([sum(9.81 * m * r for m, r in b) for b in beyond])
        self.scale = weight + self.inertia * self.top * 4
        self.friction = (
            self.scale * rng.uniform(0.05, 0.15, n),
            self.scale / self.top * rng.uniform(0.03, 0.12, n),
            self.inertia * rng.uniform(0.1, 0.6, n),
        )
        self.joint = int(rng.integers(1, n - 1 if self.effect == "joint_coupling" else n))
        small = self.kind == "hobby"
        self.bits = 12 if small else int(rng.choice([12, 14, 17, 20]))
        self.rate = int(rng.choice([200, 250, 500] if small else [250, 500, 1000]))
        self.average = bool(rng.random() < 0.5)
        if hobby:
            self.rate, self.average = 500, False
        self.noise = self.scale * rng.choice([0.002, 0.005, 0.01])
        self.close = "payload" in self.effect or rng.random() < 0.3
        off = (0.003, 0.003, 0.003) if self.close else (0.2, 0.25, 0.12)
        self.nominal_friction = [x * np.exp(s * rng.normal(size=n)) for x, s in zip(self.friction, off)]
        self.nominal = [dict(link) for link in self.links]
        for link in self.nominal if not self.close else []:
            link["m"] *= 1 + 0.08 * rng.normal()
            link["com"] = link["com"] * (1 + 0.05 * rng.normal(size=3))
            link["moments"] = link["moments"] * (1 + 0.08 * rng.normal())
        self.carried = self.load()
        self.bristle = self.push = 0.0

    def beyond(self, joint):
        """Masses that a joint carries, and how far they are at most."""
        reach, out = 0.0, []
        for link in self.links[joint:]:
            out.append((link["m"], reach + np.linalg.norm(link["com"])))
            reach += np.linalg.norm(link["way"])
        return out

    def load(self):
        if "payload" not in self.effect:
            return ""
        m = 0.35 * self.links[-1]["m"] + 0.15 * sum(link["m"] for link in self.links[-2:])
        at = 0.9 * self.links[-1]["way"] + 0.02 * self.rng.normal(size=3)
        return f'<body name="load" pos="{words(at)}"><inertial pos="0 0 0" mass="{m!r}" diaginertia="{words(3 * [m * 4e-4])}"/></body>'

    def hidden(self, q, v, tau):
        """Torque of the effect."""
        out, j, level, top = np.zeros(self.n), self.joint, self.scale[self.joint], self.top
        sharp = np.tanh(v[j] / (0.002 * top))
        if "cogging" in self.effect:
            out[j] += 0.05 * level * np.sin(GEAR * q[j] + 0.4)
        if "stribeck" in self.effect:
            out[j] -= 0.12 * level * np.exp(-((v[j] / (0.08 * top)) ** 2)) * sharp
        if self.effect == "friction_asymmetry":
            out[j] -= (v[j] > 0) * level * (0.12 * sharp + 0.05 * v[j] / top)
        if self.effect == "cable_spring":
            out[j] -= level * (0.12 * (q[j] - 0.1) + 0.03 * (q[j] - 0.1) ** 3)
        if self.effect == "joint_coupling":
            both, level = v[j] + v[j + 1], self.scale[j + 1]
            out[j : j + 2] -= level * (0.08 * np.tanh(both / (0.002 * top)) + 0.05 * both / top)
        if self.effect == "presliding_hysteresis":
            way = v[j] * STEP
            self.bristle += way / 0.03 * (1 - self.bristle * np.sign(way))
            out[j] -= 0.15 * level * self.bristle
        if self.effect == "load_dependent_friction":
            out[j] -= 0.12 * abs(tau[j]) * sharp
        if self.effect == "nonlinear_viscous_friction":
            out[j] -= 0.25 * level * abs(v[j]) * v[j] / top**2
        if self.effect == "outside":
            out[j] -= 0.15 * level * self.push * np.tanh(v[j] / (0.01 * top))
        return out

    def run(self, seed, period, periods, fast):
        """Positions, and torques of the motors, at every step of the simulation."""
        rng = np.random.default_rng([seed, *self.rng.bit_generator.seed_seq.entropy])
        orders = np.arange(1, 7)
        w = 2 * np.pi / period * orders
        a, phase = rng.normal(size=(self.n, 6)) / orders**0.7, rng.uniform(0, 2 * np.pi, (self.n, 6))
        angles = np.linspace(0, period, 500)[:, None, None] * w + phase
        speed, way = (np.abs((a * x).sum(-1)).max(0) for x in (w * np.cos(angles), np.sin(angles)))
        a *= np.minimum(fast * self.top / speed, 1.4 / way)[:, None]
        middle = np.array([0.2] + [0.4] * (self.n - 1))

        def desired(t):
            angle = w * t + phase
            sine, cosine = np.sin(angle), np.cos(angle)
            return middle + (a * sine).sum(1), (a * w * cosine).sum(1), -(a * w**2 * sine).sum(1)

        truth, model = compiled(mjcf(self.links, self.friction, 6 * self.scale, self.carried)), compiled(self.file())
        data, told = mujoco.MjData(truth), mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = desired(-BEFORE)[:2]
        mass, bandwidth = self.friction[2] + 0.5 * self.inertia, 2 * np.pi * 8
        step, q, tau = 2 * np.pi / 2**self.bits, [], []
        for k in range(int((periods * period + BEFORE) / CONTROL)):
            t = k * CONTROL - BEFORE
            told.qpos[:], told.qvel[:], told.qacc[:] = wanted = desired(t)
            mujoco.mj_inverse(model, told)
            off = bandwidth**2 * (np.round(data.qpos / step) * step - wanted[0]) + 1.6 * bandwidth * (data.qvel - wanted[1])
            u = np.clip(told.qfrc_inverse - mass * off, -6 * self.scale, 6 * self.scale)
            self.push = max(0.0, rng.normal()) if k % 250 == 0 else self.push
            for _ in range(round(CONTROL / STEP)):
                data.ctrl[:], data.qfrc_applied[:] = u, self.hidden(data.qpos, data.qvel, u)
                if t > -1e-9:
                    q.append(data.qpos.copy())
                    tau.append(u)
                mujoco.mj_step(truth, data)
        return np.array(q), np.array(tau)

    def log(self, seed, period, periods, fast):
        """Columns of a log."""
        q, tau = self.run(seed, period, periods, fast)
        t, every = np.arange(len(q)) * STEP, round(1 / (self.rate * STEP))
        if self.average:
            kernel = np.ones(2 * every + 1) / (2 * every + 1)
            tau = np.stack([np.convolve(np.pad(x, every, mode="edge"), kernel, "valid") for x in tau.T], 1)
        for j in {"delay_of_one_joint": [self.joint]}.get(self.effect, range(self.n) if "delay" in self.effect else []):
            tau[:, j] = np.interp(t - DELAY, t, tau[:, j])
        if self.effect == "torque_constant":
            tau[:, self.joint] *= 1.1
        step, rng = 2 * np.pi / 2**self.bits, np.random.default_rng([9, seed])
        tau = tau[::every] + self.noise * rng.normal(size=tau[::every].shape)
        return np.c_[t[::every], np.round(q[::every] / step) * step, tau]

    def file(self, kind="full"):
        coulomb, viscous, rotor = self.nominal_friction
        friction = [coulomb * FILES[kind][0], viscous * FILES[kind][1], rotor]
        return mjcf(self.nominal, friction, 6 * self.scale)

    def write(self, folder, kind="full"):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "arm.xml").write_text(self.file(kind))
        robot = f'name = "arm"\nurdf = "arm.xml"\nprior = "{"identified" if self.close else "cad"}"\n'
        for j in range(self.n):
            robot += (
                f'[[joint]]\nname = "joint{j + 1}"\ntorque_noise = {float(self.noise[j])!r}\nvelocity = {1.5 * self.top}\n'
                f'position_resolution = {2 * np.pi / 2**self.bits!r}\nacceleration = 50.0\n'
            )
            robot += 'identify = ["armature", "viscous", "coulomb", "offset"]\n' if FILES[kind][2] else ""
            robot += f"gear_ratio = {GEAR}\n" if "cogging" in self.effect else ""
        (folder / "robot.toml").write_text(robot)
        experiment = 'robot = "robot.toml"\n'
        names = ",".join(["t"] + [f"{c}{j + 1}" for c in ("q", "tau") for j in range(self.n)])
        for name, seed, period, periods, fast in RECORDS:
            rows = self.log(seed, period, periods, fast)
            np.savetxt(folder / f"{name}.csv", rows, "%.8g", ",", header=names, comments="")
            use = "holdout" if name == "holdout" else "fit"
            experiment += f'[[record]]\nlog = "{name}.csv"\nuse = "{use}"\nperiod = {period}\n'
        (folder / "experiment.toml").write_text(experiment)

    def right(self, effect, joints):
        """Whether a name is that of what is hidden."""
        own = f"joint{self.joint + 1}"
        if effect == "payload" or (effect == "torque_delay" and self.effect != "delay_of_one_joint"):
            return effect in self.effect
        wanted = self.effect.replace("delay_of_one_joint", "torque_delay")
        return effect in wanted and own in joints

    def told(self):
        return (
            f"{self.kind} {self.n} joints, {self.bits} bits, {self.rate} Hz{', averaged' if self.average else ''}, "
            f"{'identified' if self.close else 'cad'}: {self.effect} (joint{self.joint + 1})"
        )


def case(job):
    """What was named on one arm."""
    number, asked = job
    machine, folder = Machine(asked.seed, number, asked.hobby), asked.output / f"arm_{number:03d}"
    machine.write(folder, asked.file)
    return arms.diagnosed(machine, folder, asked, FRICTION if asked.file != "full" else ())


def main():
    parser = arms.options(34, "target/mujoco_arms")
    parser.add_argument("--hobby", action="store_true", help="hobby arms alone: 12 bits, 500 Hz, torques at an instant")
    parser.add_argument("--file", choices=FILES, default="full", help="what files state of friction; the names of friction that others lack are passed over")
    arms.count(case, parser.parse_args(), {"outside"})


if __name__ == "__main__":
    main()
