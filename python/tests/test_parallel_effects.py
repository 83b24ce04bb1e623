"""Effects in the drives of a hexapod, in formulas of their own: what was written for MuJoCo leaves none of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_verify import hexapod

import excite

RATE, NOISE = 200.0, 0.5


def bristles(q, reach):
    """The slope of dry friction that turns over a way: one in sliding."""
    z, out = 0.0, []
    for d in np.diff(q, prepend=q[0]):
        z = np.sign(d) + (z - np.sign(d)) * np.exp(-abs(d) / reach) if d else z
        out.append(z)
    return np.array(out)


def sign(v):
    """Dry friction of a log that does not know which way a leg creeps."""
    return np.tanh(v / 2e-3)


#: force that the drive of one leg has to make beyond the model, of its position, velocity, force and that of the bodies
EFFECTS = {
    "stribeck_friction": lambda q, v, f, load: f + 60.0 * sign(v) * np.exp(-np.abs(v) / 0.05),
    "nonlinear_viscous_friction": lambda q, v, f, load: f + 300.0 * v * np.abs(v),
    "friction_asymmetry": lambda q, v, f, load: f + 150.0 * np.abs(v),
    "load_dependent_friction": lambda q, v, f, load: f + 0.25 * np.abs(load) * sign(v),
    "position_dependent_friction": lambda q, v, f, load: f + 25.0 * np.sin(40.0 * q) * sign(v),
    "presliding_hysteresis": lambda q, v, f, load: f + 60.0 * (bristles(q, 0.02) - sign(v)),
    "cogging": lambda q, v, f, load: f + 20.0 * np.sin(200.0 * q + 0.4),
    "cable_spring": lambda q, v, f, load: f + 9000.0 * (q - 0.11) ** 2,
    "torque_constant": lambda q, v, f, load: 1.15 * f,
    "torque_saturation": lambda q, v, f, load: f + 0.5 * np.sign(f) * np.clip(np.abs(f) - 90.0, 0.0, None),
    "torque_delay": lambda q, v, f, load: np.interp(np.arange(len(f)) - 3.0, np.arange(len(f)), f),
}




def warming():
    """Friction that rises as a leg warms up, from one record to the next."""
    warm = 0.0

    def effect(q, v, f, load):
        nonlocal warm
        out = []
        for x in v:
            power = (25.0 * abs(x) + 80.0 * x**2) / (25.0 * 0.45 + 80.0 * 0.45**2)
            warm += (power - warm) / (8.0 * RATE)
            out.append(warm)
        return f + np.array(out) * (40.0 * sign(v) + 150.0 * v)

    return effect


#: effects that remember, by what makes one that is new
REMEMBER = {"thermal_friction": warming}

#: whether the legs have mass, and the effects of the first drives
LOGS = [
    (False, ["thermal_friction"]),
    (True, ["load_dependent_friction", "torque_constant"]),
    (True, ["presliding_hysteresis", "cogging"]),
    (False, ["stribeck_friction"]),
    (False, ["cable_spring"]),
    (False, ["nonlinear_viscous_friction"]),
    (False, ["position_dependent_friction"]),
    (False, ["friction_asymmetry", "torque_saturation"]),
    (False, 6 * ["torque_delay"]),
]


def test_no_effect_is_left_out():
    assert {*EFFECTS, *REMEMBER} == {e for _, effects in LOGS for e in effects}


def recorded(mass, effects):
    """A record to fit and one held out, with an effect for each of the first drives, a name or a function."""
    robot = hexapod(mass)
    motion = excite.Trajectory.read(Path(__file__).resolve().parents[2] / "trajectories/hexapod/trajectory.json")
    rng, records = np.random.default_rng(3), []
    added = [REMEMBER[e]() if e in REMEMBER else EFFECTS.get(e, e) for e in effects]
    for seed, use in enumerate(["fit", "holdout"]):
        run = excite.simulate(
            robot, motion, periods=2 - seed, rate=RATE, noise=0.0, derivatives=True, seed=seed
        ).record(use, name=use)
        q, v, tau = (np.array(x, float) for x in (run.q, run.dq, run.tau))
        for leg, effect in enumerate(added):
            f = tau[:, leg]
            # without the friction of the robot file
            load = f - 80.0 * v[:, leg] - 25.0 * sign(v[:, leg])
            tau[:, leg] = effect(q[:, leg], v[:, leg], f, load)
        records.append(run.but(tau=tau + rng.normal(0.0, NOISE, tau.shape), dq=None, ddq=None))
    return excite.Experiment(robot, records)


@pytest.mark.parametrize("mass, effects", LOGS, ids=["-".join(dict.fromkeys(e)) for _, e in LOGS])
def test_effects_of_drives_in_mujoco(mass, effects):
    pytest.importorskip("mujoco")
    experiment = recorded(mass, effects)
    diagnosis = excite.diagnose(experiment, next=False)
    found = excite.verify(experiment, diagnosis=diagnosis, horizons=(0.1,), runs=1)
    print(found, [(c["effect"], c["joints"]) for c in diagnosis.claims])
    rows = found.to_dict()["torque"]["joints"]
    for row in rows[: len(effects)]:
        assert row["measured"] > 0.9 * row["claimed"] > 0.6, row
    assert found.shrink > 0.9 and found.shrink > 0.9 * found.claimed
    text = diagnosis.files["effects.py"]
    assert ("LOADED = True" in text) == ("load_dependent_friction" in effects)


def test_files_are_never_worse():
    """Friction of more waves than are looked for, and no claim: bodies that can exist would leave five times the gap."""
    pytest.importorskip("mujoco")

    def waves(q, v, f, load):
        return f + 25.0 * np.sin(90.0 * q) * sign(v)

    experiment = recorded(False, [waves, "nonlinear_viscous_friction"])
    with pytest.warns(excite.ExciteWarning, match="the robot files hold the nominal model"):
        diagnosis = excite.diagnose(experiment, next=False)
    found = excite.verify(experiment, diagnosis=diagnosis, horizons=(0.1,), runs=1)
    assert not diagnosis.claims and found.shrink == pytest.approx(0.0, abs=1e-6)
