

class Chain:
    """Where the drives of a closed chain act, and what closes its loops."""

    def __init__(self, model):
        import mujoco

        kinds, closures = mujoco.mjtObj, mujoco.mjtEq
        self.tendons = [mujoco.mj_name2id(model, kinds.mjOBJ_TENDON, name) for name in JOINTS]
        joints = [mujoco.mj_name2id(model, kinds.mjOBJ_JOINT, name) for name in JOINTS]
        # legs without mass are tendons; any other drive is one of a joint
        driven = [] if min(self.tendons) >= 0 and max(joints) < 0 else [model.joint(name) for name in JOINTS]
        self.at = np.array([joint.qposadr[0] for joint in driven], int)
        self.dof = np.array([joint.dofadr[0] for joint in driven], int)
        sizes = {int(closures.mjEQ_CONNECT): 3, int(closures.mjEQ_WELD): 6, int(closures.mjEQ_JOINT): 1}
        self.loops = [(e, sizes.get(int(kind), 0)) for e, kind in enumerate(model.eq_type)]
        self.rows = np.zeros((len(JOINTS) + sum(size for _, size in self.loops), model.nv))
        self.ends = [np.zeros((3, model.nv)) for _ in range(4)]

    def ways(self, model, data):
        """Jacobian of what the drives move, (drives, nv)."""
        import mujoco

        if len(self.dof):
            return np.eye(model.nv)[self.dof]
        out, (pa, _, pb, _) = np.zeros((len(JOINTS), model.nv)), self.ends
        for row, leg in zip(out, self.tendons):
            a, b = (int(model.wrap_objid[model.tendon_adr[leg] + end]) for end in range(2))
            mujoco.mj_jacSite(model, data, pa, None, a)
            mujoco.mj_jacSite(model, data, pb, None, b)
            way = data.site_xpos[b] - data.site_xpos[a]
            row[:] = way @ (pb - pa) / np.linalg.norm(way)
        return out

    def state(self, data):
        """Positions and velocities of the drives, rad or m and per s."""
        if len(self.dof):
            return data.qpos[self.at], data.qvel[self.dof]
        return data.ten_length[self.tendons] - ZERO, data.ten_velocity[self.tendons]

    def balance(self, model, data, force):
        """Torque of the drives, N m or N, that balances a force (nv,) on all joints, with the forces in the loops.

        S tau + J^T lambda = force, with the Jacobian J of the gaps of the loops; S has a column for each drive.
        """
        import mujoco

        at = len(JOINTS)
        self.rows[:at] = self.ways(model, data)
        pa, ra, pb, rb = self.ends
        for e, size in self.loops:
            a, b = model.eq_obj1id[e], model.eq_obj2id[e]
            if size == 1:
                # one joint follows another
                self.rows[at] = 0.0
                self.rows[at, model.jnt_dofadr[a]] = 1.0
                self.rows[at, model.jnt_dofadr[b]] = -model.eq_data[e, 1]
            elif size:
                mujoco.mj_jacSite(model, data, pa, ra, a)
                mujoco.mj_jacSite(model, data, pb, rb, b)
                self.rows[at : at + size] = np.concatenate([pa - pb, ra - rb])[:size]
            at += size
        return np.linalg.lstsq(self.rows.T, force, rcond=1e-10)[0][: len(JOINTS)]


class Installed:
    """The callback of one model: adds the effects to `qfrc_passive`, and remembers what they need, data by data."""

    def __init__(self, model):
        self.address = model._address
        self.chain = Chain(model)
        self.force = np.zeros(model.nv)
        self.memory = {}

    def __call__(self, model, data):
        if model._address != self.address:
            return
        import mujoco

        chain, kinds = self.chain, mujoco.mjtConstraint
        q, dq = chain.state(data)
        passed, before = recalled(self.memory, data, q)
        load = 0.0 * q
        if LOADED:
            # with the acceleration of the last step
            mujoco.mj_rne(model, data, 1, self.force)
            load = chain.balance(model, data, self.force)
        dry, other, after = parts(q, dq, load, passed, before)
        self.memory[data._address] = (data.time, after)
        of, losses = (chain.dof, model.dof_frictionloss) if len(chain.dof) else (chain.tendons, model.tendon_frictionloss)
        kind = kinds.mjCNSTR_FRICTION_DOF if len(chain.dof) else kinds.mjCNSTR_FRICTION_TENDON
        made = np.zeros(len(JOINTS))
        for j, on in enumerate(of):
            made[j], level = float(other[j]), float(dry[j])
            if level != 0.0:
                level = held(data, kind, on, losses[on], level)
                made[j] += level * float(np.tanh(dq[j] / WIDTH[j]))
        data.qfrc_passive -= made @ chain.ways(model, data)


def install(model):
    """Makes MuJoCo add the effects in every mj_step and mj_forward of this model (`mjcb_passive`).

    `mujoco.set_mjcb_passive(None)` takes them out again. What acts in drives is not a force: use `command` before
    mj_step, and `inverse` along a motion.
    """
    import mujoco

    installed = Installed(model)
    mujoco.set_mjcb_passive(installed)
    return installed


def inverse(model, qpos, qvel, qacc, dt, memory=None):
    """Torque that the drives report along a motion (samples, drives), N m or N, all effects included.

    model: robot.xml as MuJoCo loads it; qpos, qvel, qacc: all its joints (samples, nq and nv), with loops that stay
    closed; dt: time between samples, s; memory: from `start`, or a dict that carries it from run to run (it is changed;
    empty before the first; what is in `LASTING` belongs there, the rest begins anew with every run).
    """
    import mujoco

    qpos, qvel, qacc = (np.asarray(x, float) for x in (qpos, qvel, qacc))
    data, chain, force = mujoco.MjData(model), Chain(model), np.zeros(model.nv)
    previous, flags = mujoco.get_mjcb_passive(), int(model.opt.disableflags)
    losses = [model.dof_frictionloss.copy(), model.tendon_frictionloss.copy()]
    bits = mujoco.mjtDisableBit
    off = (bits.mjDSBL_CONTACT, bits.mjDSBL_LIMIT, bits.mjDSBL_EQUALITY)
    tau, actuators = np.zeros((len(qpos), len(JOINTS))), [model.actuator(name).id for name in JOINTS]
    # what a drive does without a command
    bias = model.actuator_biasprm[actuators, 0]
    now = None
    try:
        mujoco.set_mjcb_passive(None)
        model.opt.disableflags = flags | sum(int(bit) for bit in off)
        # the solver's friction takes its sign from the acceleration too; along a motion that of the velocity is known
        model.dof_frictionloss[:], model.tendon_frictionloss[:] = 0.0, 0.0
        for i in range(len(qpos)):
            data.qpos[:], data.qvel[:], data.qacc[:] = qpos[i], qvel[i], qacc[i]
            mujoco.mj_inverse(model, data)
            q, dq = chain.state(data)
            now = dict(memory or start(q)) if now is None else now
            loss = np.zeros(len(JOINTS)) if len(chain.dof) else losses[1][chain.tendons]
            made = chain.balance(model, data, data.qfrc_inverse + losses[0] * np.sign(data.qvel))
            load = 0.0 * q
            if LOADED:
                mujoco.mj_rne(model, data, 1, force)
                load = chain.balance(model, data, force)
            dry, other, now = parts(q, dq, load, dt if i else 0.0, now)
            tau[i] = made - bias + other + (loss + dry) * np.sign(dq)
    finally:
        mujoco.set_mjcb_passive(previous)
        model.opt.disableflags = flags
        model.dof_frictionloss[:], model.tendon_frictionloss[:] = losses
    if memory is not None and now is not None:
        memory.update(now)
    return logged(tau, dt)
