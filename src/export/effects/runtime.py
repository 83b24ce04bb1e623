

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
    out = [tau[..., j] for j in range(len(JOINTS))]
    for j, f, _ in DRIVES:
        out[j] = out[j] + f(tau[..., j], xp) - tau[..., j]
    return xp.stack(out, -1)


def command(told, xp=np):
    """What the actuators of robot.xml are to be told (`data.ctrl`) where the drives are told `told` (..., joints).

    They have the gains and delays of the drives; what they have not is taken off here, N m or N.
    """
    tau = told
    for _ in range(60):
        less = [0.0 * tau[..., j] for j in range(len(JOINTS))]
        for j, f, native in DRIVES:
            if not native:
                less[j] = less[j] + f(tau[..., j], xp) - tau[..., j]
        tau = 0.5 * tau + 0.5 * (told - xp.stack(less, -1))
    return tau
