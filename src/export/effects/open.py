

def displacement(q, dq, ddq, xp=np):
    """Way of the joints beyond what their encoders read, rad or m, its rate and acceleration (..., joints)."""
    way = [[0.0 * q[..., j] for j in range(len(JOINTS))] for _ in range(3)]
    for j, f in DISPLACED:
        for rows, x in zip(way, f(q[..., j], dq[..., j], ddq[..., j], xp)):
            rows[j] = rows[j] + x
    return tuple(xp.stack(rows, -1) for rows in way)


def encoder(q, xp=np):
    """What the encoders read where the joints stand at q (..., joints), rad or m."""
    read = q
    for _ in range(20):
        read = q - displacement(read, 0.0 * q, 0.0 * q, xp)[0]
    return read


class Installed:
    """The callback of one model: adds the effects to `qfrc_passive`, and remembers what they need, data by data."""

    def __init__(self, model):
        joints = [model.joint(name) for name in JOINTS]
        free = [model.joint(name) for name, _ in FREE]
        self.address = model._address
        self.at = np.array([joint.qposadr[0] for joint in joints], int)
        self.dof = np.array([joint.dofadr[0] for joint in joints], int)
        self.free_at = np.array([joint.qposadr[0] for joint in free], int)
        self.free_dof = np.array([joint.dofadr[0] for joint in free], int)
        self.load = np.zeros(model.nv)
        # dry friction that is not left to the solver, N m or N
        self.loss = np.zeros(len(joints))
        self.memory = {}

    def __call__(self, model, data):
        if model._address != self.address:
            return
        import mujoco

        q, dq = data.qpos[self.at], data.qvel[self.dof]
        passed, before = recalled(self.memory, data, q)
        # with the acceleration of the last step, or that which mj_inverse is asked for
        mujoco.mj_rne(model, data, 1, self.load)
        dry, other, after = parts(q, dq, self.load[self.dof], passed, before)
        self.memory[data._address] = (data.time, after)
        kind = mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF
        for j, dof in enumerate(self.dof):
            force, level = float(other[j]), float(dry[j]) + self.loss[j]
            if level != 0.0:
                level = held(data, kind, dof, model.dof_frictionloss[dof], level)
                # along a motion the sign of the velocity is known
                known = self.loss[j] > 0.0
                force += level * float(np.sign(dq[j]) if known else np.tanh(dq[j] / WIDTH[j]))
            data.qfrc_passive[dof] -= force
        for (_, f), at, dof in zip(FREE, self.free_at, self.free_dof):
            if f is not None:
                data.qfrc_passive[dof] += f(data.qpos[at], data.qvel[dof])


def install(model):
    """Makes MuJoCo add the effects in every mj_step, mj_forward and mj_inverse of this model (`mjcb_passive`).

    `mujoco.set_mjcb_passive(None)` takes them out again. What acts in drives and encoders is not a force: use
    `command` before mj_step, `encoder` for what is read, and `inverse` along a motion.
    """
    import mujoco

    installed = Installed(model)
    mujoco.set_mjcb_passive(installed)
    return installed


def inverse(model, q, dq, ddq, dt, memory=None, substep=2e-4):
    """Torque that the drives report along a motion (samples, joints), N m or N, all effects included.

    model: robot.xml as MuJoCo loads it; q, dq, ddq: what the encoders read (samples, joints), with its derivatives;
    dt: time between samples, s; memory: from `start`, or a dict that carries it from run to run (it is changed; empty
    before the first; what is in `LASTING` belongs there, the rest begins anew with every run). Joints that no drive moves are integrated on their springs.
    """
    import mujoco

    q, dq, ddq = (np.asarray(x, float) for x in (q, dq, ddq))
    data = mujoco.MjData(model)
    previous, flags = mujoco.get_mjcb_passive(), int(model.opt.disableflags)
    bits = mujoco.mjtDisableBit
    model.opt.disableflags = flags | int(bits.mjDSBL_CONTACT) | int(bits.mjDSBL_LIMIT)
    here = install(model)
    free, at = here.free_dof, here.free_at
    tau = np.zeros_like(q)
    # the solver's friction takes its sign from the acceleration too; along a motion that of the velocity is known
    here.loss = model.dof_frictionloss[here.dof].copy()
    model.dof_frictionloss[here.dof] = 0.0

    if memory:
        here.memory[data._address] = (0.0, dict(memory))

    def forces(x, v, a, time):
        _, rate, acceleration = way = displacement(x, v, a)
        moved = zip((x, v, a), way)
        data.qpos[here.at], data.qvel[here.dof], data.qacc[here.dof] = (s + w for s, w in moved)
        data.time = time
        mujoco.mj_inverse(model, data)
        # the rotor stands where the encoder reads
        damping = np.array([np.ravel(model.dof_damping[dof])[0] for dof in here.dof])
        data.qfrc_inverse[here.dof] -= model.dof_armature[here.dof] * acceleration + damping * rate
        return data.qfrc_inverse

    def inertia():
        # of the joints without drive, where the model stands
        out, one, column = np.zeros((len(free), len(free))), np.zeros(model.nv), np.zeros(model.nv)
        for k, dof in enumerate(free):
            one[:], one[dof] = 0.0, 1.0
            mujoco.mj_mulM(model, data, column, one)
            out[k] = column[free]
        return out

    def pushed(x, v, a, time):
        # acceleration of the joints without drive
        data.qacc[free] = 0.0
        force = forces(x, v, a, time)[free].copy()
        return -np.linalg.solve(inertia(), force)

    def rest(i):
        data.qvel[free] = 0.0
        for _ in range(5000):
            data.qvel[free] = 0.98 * (data.qvel[free] + substep * pushed(q[i], dq[i], ddq[i], 0.0))
            data.qpos[at] += substep * data.qvel[free]

    def backwards(drained):
        # through the first two seconds, so that nothing swings from the start
        rest(min(int(2.0 / dt), len(q) - 1))
        data.qvel[free] = 0.0
        for i in range(min(int(2.0 / dt), len(q) - 1), 0, -1):
            for s in range(count):
                w = s / count
                state = [(1 - w) * x[i] + w * x[i - 1] for x in (q, -dq, ddq)]
                data.qvel[free] *= 1.0 - min(drained * dt / count, 0.5)
                data.qvel[free] += dt / count * pushed(*state, 0.0)
                data.qpos[at] += dt / count * data.qvel[free]
        return data.qpos[at].copy(), -data.qvel[free]

    def begin():
        # seen backwards, a swing is fed: from two that are drained towards the one that is not
        data.qpos[here.at] = q[0]
        mujoco.mj_forward(model, data)
        damping = model.dof_damping.copy()
        own = zip(free, np.diag(inertia()))
        least = 15.0 + 2.0 * max(np.ravel(damping[dof])[0] / max(mass, 1e-9) for dof, mass in own)
        model.dof_damping[free] *= -1.0
        near, far = backwards(least), backwards(2.0 * least)
        model.dof_damping[:] = damping
        data.qpos[at], data.qvel[free] = (2.0 * a - b for a, b in zip(near, far))

    try:
        count = max(int(np.ceil(dt / substep)), 1)
        if len(free):
            begin()
        for i in range(len(q)):
            if len(free):
                data.qacc[free] = pushed(q[i], dq[i], ddq[i], i * dt)
            tau[i] = forces(q[i], dq[i], ddq[i], i * dt)[here.dof]
            for s in range(count if len(free) and i + 1 < len(q) else 0):
                w = s / count
                state = [(1 - w) * x[i] + w * x[i + 1] for x in (q, dq, ddq)]
                data.qvel[free] += dt / count * pushed(*state, (i + w) * dt)
                data.qpos[at] += dt / count * data.qvel[free]
    finally:
        mujoco.set_mjcb_passive(previous)
        model.opt.disableflags = flags
        model.dof_frictionloss[here.dof] = here.loss
    if memory is not None:
        memory.update(here.memory[data._address][1])
    return logged(tau, dt)
