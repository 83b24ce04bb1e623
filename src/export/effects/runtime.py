

def start(q, xp=np):
    """Memory of the effects before the first sample at the positions q (..., joints), rad or m."""
    return {key: begin(q[..., j], xp) for j, _, key, begin in REMEMBERED}


def parts(q, dq, load, dt, memory, xp=np):
    """Per joint: levels of dry friction, which acts against the velocity, other torque, N m or N; the next memory.

    q, dq: positions and velocities (..., joints), rad or m and per s; load: torque of the rigid bodies (..., joints);
    dt: time since `memory`, s; memory: from `start` or from the last call; xp: numpy, jax.numpy or torch.
    """
    dry = [0.0 * q[..., j] for j in range(len(JOINTS))]
    other = list(dry)
    after = dict(memory)
    for j, f in ADDED:
        level, more = f(q[..., j], dq[..., j], load[..., j], xp)
        dry[j], other[j] = dry[j] + level, other[j] + more
    for j, f, key, _ in REMEMBERED:
        level, more, after[key] = f(q[..., j], dq[..., j], load[..., j], dt, memory[key], xp)
        dry[j], other[j] = dry[j] + level, other[j] + more
    return dry, other, after


def torque(q, dq, load, dt, memory, xp=np):
    """Torque that the effects add to inverse dynamics (..., joints), N m or N, and the next memory; see `parts`."""
    dry, other, after = parts(q, dq, load, dt, memory, xp)
    both = [o + d * xp.tanh(dq[..., j] / WIDTH[j]) for j, (d, o) in enumerate(zip(dry, other))]
    return xp.stack(both, -1), after


def reported(tau, xp=np):
    """Torque that the drives report where they make tau (..., joints), N m or N, without their delay."""
    return told_by(DRIVES, tau, xp)


def told_by(drives, tau, xp):
    """The same of some drives only."""
    out = [tau[..., j] for j in range(len(JOINTS))]
    for j, f, _ in drives:
        out[j] = out[j] + f(tau[..., j], xp) - tau[..., j]
    return xp.stack(out, -1)


def command(told, xp=np):
    """What the actuators of robot.xml are to be told (`data.ctrl`) where the drives are told `told` (..., joints).

    They have the gains and delays of the drives; what they have not is taken off here, N m or N.
    """
    drives = [drive for drive in DRIVES if not drive[2]]
    if not drives:
        return told

    # they make no more than they report
    most, least = xp.abs(told), -xp.abs(told)
    for _ in range(60):
        tau = 0.5 * (least + most)
        over = told_by(drives, tau, xp) > told
        least, most = xp.where(over, least, tau), xp.where(over, tau, most)
    # the last step has a derivative
    tau, by = 0.5 * (least + most), 1e-4 + 1e-4 * xp.abs(told)
    slope = (told_by(drives, tau + by, xp) - told_by(drives, tau - by, xp)) / (2.0 * by)
    return tau + (told - told_by(drives, tau, xp)) / slope


def recalled(memory, data, q):
    """Time since the effects were last asked for in this data, s, and what they remember from then."""
    time, before = memory.get(data._address, (np.inf, None))
    if data.time < time:
        # a new run
        time, before = data.time, start(q)
    return data.time - time, before


def held(data, kind, on, loss, level):
    """What is left of a level of dry friction, N m or N, behind the solver's own, which holds exactly at standstill.

    kind, on: rows of the solver that have this friction, and what they act on; loss: its level in the model.
    """
    count = data.nefc
    for row in np.flatnonzero((data.efc_type[:count] == kind) & (data.efc_id[:count] == on)):
        level += loss
        data.efc_frictionloss[row] = max(level, 0.0)
        if getattr(data, "nisland", 0) and row < len(data.map_efc2iefc):
            # the copy that the solver of mj_step reads
            data.iefc_frictionloss[data.map_efc2iefc[row]] = max(level, 0.0)
        level = min(level, 0.0)
    return level


def logged(tau, dt):
    """What the log of the drives shows where they make tau (samples, joints) every dt, s: gains, limits, delays."""
    tau, times = reported(tau), dt * np.arange(len(tau))
    for j, seconds in DELAYED:
        tau[:, j] = np.interp(times - seconds, times, tau[:, j])
    return tau
