"""A hexapod that shares nothing with the library: does `excite load` tell the truth, and does it know how well?

    python3 tests/data/hexapod.py --excite target/release/excite --machines 8 --output target/hexapod

makes machines of other dimensions and masses (legs with mass, friction that drops and sticks, encoders, coloured
noise, drive zeros), records them empty and loaded under several conditions, runs `excite load` on each pair, and
prints errors and how often the 95 % intervals hold the truth. Forces come from partial velocities of every body, in
base axes; with `--check FOLDER` they are compared with states that MuJoCo has evaluated. Needs numpy.
"""

import argparse
import json
import os
import subprocess

import numpy as np

GRAVITY = np.array([0, 0, -9.81])
cross = np.cross


def turn(m, v):
    return np.einsum("...ij,...j->...i", m, v)


def about(axis, a):
    """Rotations about a coordinate axis, one for each angle."""
    c, s, one, zero = np.cos(a), np.sin(a), np.ones_like(a), np.zeros_like(a)
    rows = {
        0: [[one, zero, zero], [zero, c, -s], [zero, s, c]],
        1: [[c, zero, s], [zero, one, zero], [-s, zero, c]],
        2: [[c, -s, zero], [s, c, zero], [zero, zero, one]],
    }[axis]
    return np.stack([np.stack(r, -1) for r in rows], -2)


def platform(x, xd, xdd):
    """Position, rotation, velocity, angular velocity and their derivatives from x y z roll pitch yaw."""
    p, y = x[:, 4], x[:, 5]
    zero, one = np.zeros_like(p), np.ones_like(p)
    ez = np.stack([zero, zero, one], -1)
    ey = np.stack([-np.sin(y), np.cos(y), zero], -1)
    ex = np.stack([np.cos(y) * np.cos(p), np.sin(y) * np.cos(p), -np.sin(p)], -1)
    rd, pd, yd = xd[:, 3:4], xd[:, 4:5], xd[:, 5:6]
    w1 = yd * ez
    w2 = w1 + pd * ey
    w = w2 + rd * ex
    wd = xdd[:, 5:6] * ez + xdd[:, 4:5] * ey + pd * cross(w1, ey) + xdd[:, 3:4] * ex + rd * cross(w2, ex)
    rotation = about(2, y) @ about(1, p) @ about(0, x[:, 3])
    return x[:, :3], rotation, xd[:, :3], w, xdd[:, :3], wd


def leg_motion(leg, p, rotation, v, w, vd, wd):
    """Length, rates and frame of a leg in a universal joint, and its rates for any velocity of its end."""
    b = turn(rotation, np.broadcast_to(leg["b"], p.shape))
    along = p + b - leg["a"]
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    s = along / length
    end, pull = v + cross(w, b), vd + cross(wd, b) + cross(w, cross(w, b))
    s0 = s @ leg["frame"]
    beta, alpha = np.arcsin(s0[:, 0]), np.arctan2(-s0[:, 1], s0[:, 2])
    middle = leg["frame"] @ about(0, alpha)
    frame = middle @ about(1, beta)
    x0, y1 = np.broadcast_to(leg["frame"][:, 0], p.shape), middle[:, :, 1]
    x2, y2 = frame[:, :, 0], frame[:, :, 1]
    cb = np.cos(beta)[:, None]

    def dot(a, c):
        return np.sum(a * c, -1, keepdims=True)

    def rates(end):
        bd, ad = dot(end, x2) / length, -dot(end, y2) / (length * cb)
        return ad, bd, ad * x0 + bd * y1

    ad, bd, wl = rates(end)
    rate = dot(end, s)
    rest = pull - 2 * rate * cross(wl, s) - length * (ad * bd * cross(cross(x0, y1), s) + cross(wl, cross(wl, s)))
    bdd, add = dot(rest, x2) / length, -dot(rest, y2) / (length * cb)
    wdl = add * x0 + bdd * y1 + ad * bd * cross(x0, y1)
    return dict(b=b, s=s, length=length[:, 0], rate=rate[:, 0], frame=frame, w=wl, wd=wdl, pull=pull, rates=rates)


def power(body, frame, w, wd, pull, twists):
    """Generalised force of a body for each of six unit twists."""
    mass, centre, tensor = body
    c = turn(frame, np.broadcast_to(centre, w.shape))
    inertia = frame @ tensor @ np.swapaxes(frame, -1, -2)
    force = mass * (pull + cross(wd, c) + cross(w, cross(w, c)) - GRAVITY)
    moment = turn(inertia, wd) + cross(w, turn(inertia, w))
    return np.stack([np.sum(force * (v + cross(o, c)), -1) + np.sum(moment * o, -1) for v, o in twists], -1)


def forces(machine, state, bodies):
    """Forces along the legs, their lengths and rates, for a platform of these bodies."""
    p, rotation, v, w, vd, wd = state
    n, zero = len(p), np.zeros((len(p), 3))
    unit = []
    for k in range(6):
        e = np.zeros((n, 6))
        e[:, k] = 1
        unit.append((e[:, :3], e[:, 3:]))
    q, jacobian, legs = np.zeros((n, 6)), np.zeros((n, 6, 6)), []
    for body in bodies:
        q += power(body, rotation, w, wd, vd, unit)
    for i, leg in enumerate(machine["legs"]):
        k = leg_motion(leg, p, rotation, v, w, vd, wd)
        legs.append(k)
        jacobian[:, i, :3], jacobian[:, i, 3:] = k["s"], cross(k["b"], k["s"])
        ends = [vo + cross(wo, k["b"]) for vo, wo in unit]
        turns = [k["rates"](e)[2] for e in ends]
        q += power(leg["cylinder"], k["frame"], k["w"], k["wd"], zero, [(zero, t) for t in turns])
        q += power(leg["rod"], k["frame"], k["w"], k["wd"], k["pull"], list(zip(ends, turns)))
    f = np.linalg.solve(np.swapaxes(jacobian, 1, 2), q[..., None])[..., 0]
    return f, np.stack([k["length"] for k in legs], -1), np.stack([k["rate"] for k in legs], -1)


def make_machine(seed):
    r = np.random.default_rng(1000 + seed)
    base, top, height = r.uniform(0.5, 0.75), r.uniform(0.28, 0.4), r.uniform(0.75, 0.95)
    near, far = r.uniform(0.15, 0.3), r.uniform(0.75, 0.9)
    home, legs = np.array([0, 0, height]), []
    for i in range(6):
        at, sign = 2 * np.pi * (i // 2) / 3, 2 * (i % 2) - 1
        ring = lambda radius, half: radius * np.array([np.cos(at + sign * half), np.sin(at + sign * half), 0])
        a, b = ring(base, near) + r.normal(0, 0.004, 3), ring(top, far) + r.normal(0, 0.004, 3)
        z = (home + b - a) / np.linalg.norm(home + b - a)
        x = cross([0, 0, 1.0], z)
        x /= np.linalg.norm(x)

        def tube(m, length, radius, centre):
            side = m * length**2 / 12
            return m, np.array([0, 0, centre]), np.diag([side, side, m * radius**2 / 2])

        legs.append(dict(a=a, b=b, frame=np.stack([x, cross(z, x), z], -1),
                         cylinder=tube(r.uniform(3, 7), 0.5, 0.035, 0.25), rod=tube(r.uniform(1.2, 3), 0.5, 0.015, -0.24)))
    mass = r.uniform(20, 35)
    body = (mass, np.array([r.normal(0, 0.01), r.normal(0, 0.01), r.uniform(0, 0.04)]),
            np.diag([1, 1.08, 1.9]) * mass * top**2 * 0.28)
    return dict(legs=legs, platform=body, home=home, dry=r.uniform(12, 30, 6), viscous=r.uniform(50, 120, 6),
                sticking=np.abs(r.normal(15, 3, 6)), speed=r.uniform(0.008, 0.02, 6),
                zero=np.array([np.linalg.norm(home + l["b"] - l["a"]) for l in legs]) - 0.2, piston=[1.96e-3, 1.65e-3])


def make_load(mass, seed):
    if mass == 22.26:
        return mass, np.array([0.03, -0.02, 0.12]), np.array([[0.26, 0.012, -0.02], [0.012, 0.29, 0.015], [-0.02, 0.015, 0.33]])
    r = np.random.default_rng(77 + seed)
    centre = np.array([r.normal(0, 0.03), r.normal(0, 0.03), r.uniform(0.06, 0.12)])
    axes, _ = np.linalg.qr(r.normal(size=(3, 3)))
    return mass, centre, axes @ np.diag([0.24, 0.29, 0.35]) @ axes.T * (mass / 22.26) ** (5 / 3)


def sines(t, lists):
    """Sums of (coordinate, frequency, amplitude, phase) with their derivatives."""
    x, xd, xdd = (np.zeros((len(t), 6)) for _ in range(3))
    for j, f, a, phase in lists:
        w = 2 * np.pi * f
        x[:, j] += a * np.sin(w * t + phase)
        xd[:, j] += a * w * np.cos(w * t + phase)
        xdd[:, j] -= a * w * w * np.sin(w * t + phase)
    return x, xd, xdd


def motion(kind, t, seed):
    """`paper`: one sine about every axis; `rich`: six sines in all coordinates. Both repeat after 10 s."""
    if kind == "paper":
        r = np.random.default_rng(5 + seed)
        return sines(t, [(3 + k, f, 0.2, r.uniform(0, 2 * np.pi)) for k, f in enumerate((0.4, 0.5, 0.6))])
    r = np.random.default_rng(50 + seed)
    lists = []
    for j in range(6):
        for h in (3, 5, 8, 11, 14, 17):
            a = (0.07 if j < 3 else 0.2) / 6 * r.uniform(0.6, 1.2) * np.sqrt(5 / h)
            lists.append((j, (h + (j % 3 == 0) - (j % 3 == 1)) / 10, a, r.uniform(0, 2 * np.pi)))
    return sines(t, lists)


def designed(path, t):
    """The Fourier series of a trajectory file, with their derivatives."""
    with open(path) as file:
        series = json.load(file)
    w = 2 * np.pi * np.array(series["harmonics"]) / series["period"]
    s, c = (np.array([joint[k] for joint in series["coefficients"]]) for k in ("sin", "cos"))
    angle = np.outer(t, w)
    sin, cos = np.sin(angle), np.cos(angle)
    x = np.array([joint["constant"] for joint in series["coefficients"]]) + sin @ s.T + cos @ c.T
    return x, (cos * w) @ s.T - (sin * w) @ c.T, -(sin * w**2) @ s.T - (cos * w**2) @ c.T


def coloured(n, r, size, rate, corner):
    """First-order noise, by its spectrum."""
    m = n + 2000
    f = np.fft.rfftfreq(m, 1 / rate)
    y = np.fft.irfft(np.fft.rfft(r.normal(size=m)) / np.sqrt(1 + (f / corner) ** 2), m)[:n]
    return size * y / np.sqrt(np.mean(1 / (1 + (f / corner) ** 2)))


def wandering(n, rate, r, size):
    """A smooth tracking error of 0.5 to 4 Hz, with its derivatives."""
    f = np.fft.rfftfreq(n, 1 / rate)
    band = (f > 0.5) & (f < 4)
    s = np.zeros(len(f), complex)
    s[band] = (r.normal(size=band.sum()) + 1j * r.normal(size=band.sum())) / (1 + f[band] ** 2)
    s *= size / np.std(np.fft.irfft(s, n))
    w = 2j * np.pi * f
    return [np.fft.irfft(s * w**k, n) for k in range(3)]


def bristles(v, step, dry, extra, speed, stiffness=2.5e5):
    """LuGre friction without damping along a known velocity, in exact steps."""
    z, out = np.zeros(v.shape[1]), np.zeros_like(v)
    for i in range(1, len(v)):
        for k in range(20):
            u = v[i - 1] + (v[i] - v[i - 1]) * (k + 0.5) / 20
            most = (dry + extra * np.exp(-((u / speed) ** 2))) / stiffness
            decay = np.exp(-np.abs(u) / most * step / 20)
            z = z * decay + np.sign(u) * most * (1 - decay)
        out[i] = stiffness * z
    return out


def record(m, c, seed, machine_seed, load, offset):
    r = np.random.default_rng(seed)
    n = int(c["rate"] * c["seconds"])
    t = np.arange(n) / c["rate"]
    if c["motion"].endswith(".json"):
        x, xd, xdd = designed(c["motion"], t)
    else:
        x, xd, xdd = motion(c["motion"], t, machine_seed)
        x[:, :3] += m["home"]
    for j in range(6):
        for to, add in zip((x, xd, xdd), wandering(n, c["rate"], r, 3e-5 if j < 3 else 1e-4)):
            to[:, j] += add
    f, length, v = forces(m, platform(x, xd, xdd), [m["platform"]] + ([load] if load else []))
    # dry friction grows with the load
    dry = m["dry"] * (1 + (0.1 * load[0] / 22.26 if load else 0))
    extra = m["sticking"] * c["stribeck"]
    if c["sticks"]:
        friction = bristles(v, 1 / c["rate"], dry, extra, m["speed"])
    else:
        friction = (dry + extra * np.exp(-((v / m["speed"]) ** 2))) * np.tanh(v / 2e-4)
    noise = np.stack([coloured(n, r, 2 * c["noise"], c["rate"], 8.0) + r.normal(0, c["noise"], n) for _ in range(6)], -1)
    q = np.round((length - m["zero"] + r.normal(0, 2e-6, v.shape)) / c["encoder"]) * c["encoder"]
    return t, q, f + friction + m["viscous"] * v + offset + noise


def write_log(path, m, t, q, tau, pressures):
    names = [f"q{i + 1}" for i in range(6)]
    columns, digits = [t[:, None], q], ["%.6f"] + ["%.7f"] * 6
    if pressures:
        a, b = m["piston"]
        low = np.full_like(tau, 3.5e5)
        high = np.round((tau + low * b + 101325.0 * (a - b)) / a / 20) * 20
        names += [f"pa{i + 1}" for i in range(6)] + [f"pb{i + 1}" for i in range(6)]
        columns += [high, low]
        digits += ["%.0f"] * 12
    else:
        names += [f"tau{i + 1}" for i in range(6)]
        columns.append(tau)
        digits += ["%.4f"] * 6
    np.savetxt(path, np.hstack(columns), delimiter=",", header="t," + ",".join(names), comments="", fmt=digits)


def write_robot(path, m, c, seed):
    r = np.random.default_rng(900 + seed)
    vec = lambda a: "[" + ", ".join(f"{float(v):.9g}" for v in a) + "]"
    six = lambda i: vec([i[0, 0], i[0, 1], i[0, 2], i[1, 1], i[1, 2], i[2, 2]])
    body = lambda b, k: f"{{ mass = {b[0] * k:.8g}, com = {vec(b[1])}, inertia = {six(b[2] * k)} }}"
    z = m["home"][2]
    mass, centre, tensor = m["platform"]
    lines = ['name = "hexapod"', 'mechanism = "gough-stewart"', "home = " + vec([0, 0, z, 0, 0, 0]), 'bodies = "legs"',
             "[workspace]", "x = [-0.1, 0.1]", "y = [-0.1, 0.1]", f"z = [{z - 0.1:.4f}, {z + 0.1:.4f}]", "tilt = 0.35",
             "yaw = [-0.3, 0.3]", "velocity = 0.8", "acceleration = 6.0", "angular_velocity = 2.0", "angular_acceleration = 15.0",
             "[actuator]", "position = [0.0, 0.42]", "velocity = 1.0", "acceleration = 10.0", "effort = 900.0",
             "torque_noise = 2.2", "position_resolution = 5e-6", "viscous = 80.0", "coulomb = 20.0",
             'identify = ["viscous", "coulomb"]', "piston = " + vec(m["piston"]),
             "[platform]", f"mass = {1.05 * mass:.6g}", "com = " + vec(centre + 0.0025), "inertia = " + six(1.05 * tensor)]
    for i, leg in enumerate(m["legs"]):
        k = 1 + c["legs"] * r.normal()
        shift = lambda n: c["geometry"] * r.normal(size=n)
        lines += ["[[leg]]", "base = " + vec(leg["a"] + shift(3)), "platform = " + vec(leg["b"] + shift(3)),
                  "rotation = [" + ", ".join(vec(row) for row in leg["frame"]) + "]",
                  f"zero = {m['zero'][i] + shift(1)[0]:.9g}", "cone = [1.2, 1.2]",
                  "cylinder = " + body(leg["cylinder"], k), "rod = " + body(leg["rod"], k)]
    with open(path, "w") as file:
        file.write("\n".join(lines) + "\n")


ORDINARY = dict(motion="rich", noise=1.0, mass=22.26, zeros=0.0, sticks=False, stribeck=1.0, geometry=0.0, legs=0.0,
                seconds=60, rate=500, period=10.0, encoder=5e-6, pressures=False)

CONDITIONS = {
    "ordinary": {},
    "noise x 3": dict(noise=3.0),
    "noise x 10": dict(noise=10.0),
    "noise x 0.3": dict(noise=0.3),
    "load of 2 kg": dict(mass=2.0),
    "load of 8 kg": dict(mass=8.0),
    "friction that sticks": dict(sticks=True),
    "Stribeck x 2": dict(stribeck=2.0),
    "zeros move by 1 N": dict(zeros=1.0),
    "geometry off by 0.5 mm": dict(geometry=5e-4),
    "legs off by 2 %": dict(legs=0.02),
    "30 s": dict(seconds=30),
    "encoder of 20 um, pressures": dict(encoder=2e-5, pressures=True),
    "paper's motion": dict(motion="paper"),
    "paper's motion, zeros move": dict(motion="paper", zeros=1.0),
}


def design(folder, c, seed, excite, question):
    """The motion that the library designs for this machine, from its robot file alone."""
    os.makedirs(folder, exist_ok=True)
    if not os.path.exists(f"{folder}/trajectory.json"):
        write_robot(f"{folder}/robot.toml", make_machine(seed), c, seed)
        command = [excite, "design", f"{folder}/robot.toml", *question, "--starts", "8", "--output", folder, "--force"]
        subprocess.run(command, check=True, capture_output=True)
    with open(f"{folder}/trajectory.json") as file:
        return f"{folder}/trajectory.json", json.load(file)["period"]


def make(folder, c, seed):
    os.makedirs(folder, exist_ok=True)
    m, load, r = make_machine(seed), make_load(c["mass"], seed), np.random.default_rng(31 + seed)
    offset = r.normal(0, 3, 6)
    moved = offset + c["zeros"] * r.normal(0, 1, 6)
    for name, carried, o, k in (("empty", None, offset, 1), ("loaded", load, moved, 2)):
        write_log(f"{folder}/{name}.csv", m, *record(m, c, [c["number"], seed, k], seed, carried, o), c["pressures"])
    write_robot(f"{folder}/robot.toml", m, c, seed)
    with open(f"{folder}/experiment.toml", "w") as file:
        file.write('robot = "robot.toml"\n')
        for name, payload in (("empty", "none"), ("loaded", "unknown")):
            file.write(f'[[record]]\nlog = "{name}.csv"\nuse = "fit"\nperiod = {c["period"]}\npayload = "{payload}"\n')
    return load


def judge(body, load):
    """Errors in percent of the mass, mm, percent of sqrt(Iii Ijj), and in standard deviations."""
    mass, centre, i = load
    truth = np.array([mass, *centre, i[0, 0], i[0, 1], i[0, 2], i[1, 1], i[1, 2], i[2, 2]])
    pairs = [(4, 4), (4, 7), (4, 9), (7, 7), (7, 9), (9, 9)]
    size = np.array([mass / 100, 1e-3, 1e-3, 1e-3] + [np.sqrt(truth[a] * truth[b]) / 100 for a, b in pairs])
    all_of = lambda key: np.array([body["mass"][key]] + body["com"][key] + body["inertia_com"][key], float)
    away = all_of("value") - truth
    return away / size, away / all_of("std")


def check(folder):
    with open(f"{folder}/sg_model.json") as file:
        model = json.load(file)
    with open(f"{folder}/sg_cases.json") as file:
        cases = json.load(file)
    cases = cases["cases"] if isinstance(cases, dict) else cases
    body = lambda b: (b["m"], np.array(b["c"]), np.array(b["Ic"]))
    legs = [dict(a=np.array(l["a"]), b=np.array(l["b"]), frame=np.array(l["R0"]), cylinder=body(l["A"]), rod=body(l["B"]))
            for l in model["legs"]]
    worst = 0
    for case in cases:
        state = [np.array(case[k], float)[None] for k in ("p", "R", "v", "w", "vd", "wd")]
        f, _, _ = forces(dict(legs=legs), state, [body(model["platform"])])
        worst = max(worst, np.abs(f - np.array(case["f_mujoco"])).max())
    print(f"{len(cases)} states, largest difference of a force from MuJoCo's: {worst:.1e} N")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--excite", default="target/release/excite")
    parser.add_argument("--machines", type=int, default=8)
    parser.add_argument("--conditions", default="", help="only those whose name has this in it")
    parser.add_argument("--output", default="target/hexapod")
    parser.add_argument("--design", metavar="OPTIONS", help="move as `excite design OPTIONS` says, `--for load`, instead of by "
                        "sines that are not designed")
    parser.add_argument("--check", metavar="FOLDER", help="compare the forces with sg_model.json and sg_cases.json")
    args = parser.parse_args()
    if args.check:
        return check(args.check)
    print(f"{'':28s} | mass % (rms) | centre mm | tensor % | covered, one step | two steps")
    total = {"one_step": [], "two_step": []}
    for number, (name, change) in enumerate(CONDITIONS.items()):
        if args.conditions not in name:
            continue
        # noise of its own for every condition
        c = ORDINARY | change | dict(number=number)
        found = {"one_step": ([], []), "two_step": ([], [])}
        for seed in range(args.machines):
            if args.design and c["motion"] != "paper":
                to = f"{args.output}/design_{seed}"
                c["motion"], c["period"] = design(to, ORDINARY, seed, args.excite, args.design.split())
            folder = f"{args.output}/{name.replace(' ', '_').replace(chr(39), '')}_{seed}"
            load = make_load(c["mass"], seed) if os.path.exists(f"{folder}/experiment.toml") else make(folder, c, seed)
            run = subprocess.run([args.excite, "load", f"{folder}/experiment.toml", "--output", f"{folder}/out", "--force"],
                                 capture_output=True, text=True)
            if run.returncode:
                print(name, seed, run.stderr.strip().splitlines()[-1])
                continue
            with open(f"{folder}/out/load.json") as file:
                methods = json.load(file)["methods"]
            for method, (errors, z) in found.items():
                e, s = judge(methods[method], load)
                errors.append(e)
                z.append(s)
        if not found["one_step"][0]:
            continue
        e = np.abs(np.array(found["one_step"][0]))
        held = {k: np.abs(np.array(z)) < 1.96 for k, (_, z) in found.items()}
        for k, h in held.items():
            total[k].append(h)
        print(f"{name:28s} | {np.sqrt((e[:, 0] ** 2).mean()):.3f} | {np.sqrt((e[:, 1:4] ** 2).mean()):.2f} | "
              f"{np.sqrt((e[:, 4:] ** 2).mean()):.2f} | {100 * held['one_step'].mean():.0f} % | "
              f"{100 * held['two_step'].mean():.0f} %", flush=True)
    for k, all_held in total.items():
        if all_held:
            print(k, f"{100 * np.concatenate(all_held).mean():.1f} % of {sum(h.size for h in all_held)}")


if __name__ == "__main__":
    main()
