"""A model in MuJoCo: inverse dynamics along a motion, and steps under a command."""

from __future__ import annotations

import importlib.util
import math
import tempfile
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from ._arrays import Array, from_columns
from ._command import Command
from ._errors import unusable

#: Largest step of the simulation, s.
STEP = 1e-3


def mujoco() -> Any:
    """MuJoCo, or how to get it."""
    try:
        import mujoco as found
    except ImportError:
        raise unusable('the simulator "mujoco" needs MuJoCo: pip install mujoco') from None
    return found


def _module(text: Optional[str]) -> Any:
    """A generated ``effects.py``, if there is one."""
    if text is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "effects.py")
        path.write_text(text, encoding="utf-8")
        spec = importlib.util.spec_from_file_location("excite_effects", path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module


class Model:
    """A robot file for MuJoCo, with the file of effects beside it where there is one; of a parallel robot there is."""

    def __init__(
        self, xml: str, effects: Optional[str], joints: List[str], name: str, tree: Optional[List[str]] = None
    ) -> None:
        mj = self._mj = mujoco()
        try:
            self._model = mj.MjModel.from_xml_string(xml)
        except ValueError as e:
            raise unusable(f"MuJoCo does not load the {name} model: {e}") from None
        self._effects = _module(effects)
        self.name = name
        #: of a parallel robot, whose loops equality constraints close, or whose legs are tendons
        self._closed = tree is not None
        chain = None if tree is None else self._effects.Chain(self._model)
        self._legs = [] if chain is None or len(chain.dof) else list(chain.tendons)
        self._joints = [] if self._legs else [self._model.joint(j) for j in joints]
        self._at = np.array([int(j.qposadr[0]) for j in self._joints], int)
        self._dof = np.array([int(j.dofadr[0]) for j in self._joints], int)
        # a state is that of all joints; legs that are tendons have none in the model
        self._tree = joints if tree is None else tree
        self._known = np.array([k for k, j in enumerate(self._tree) if self._has(j)], int)
        states = [self._model.joint(self._tree[k]) for k in self._known]
        self._states_at = np.array([int(j.qposadr[0]) for j in states], int)
        self._states_dof = np.array([int(j.dofadr[0]) for j in states], int)
        self._of_drives = [self._tree.index(j) for j in joints]
        #: length of each leg less the position of its drive
        self._zero = np.zeros(len(self._legs))
        bits = mj.mjtDisableBit
        # limits and contacts are not what is compared
        self._model.opt.disableflags |= int(bits.mjDSBL_CONTACT) | int(bits.mjDSBL_LIMIT)
        self._drives = self._actuators()
        self._own_step = float(self._model.opt.timestep)
        # what is not in the file costs no time in every step
        self._displaced = bool(getattr(self._effects, "DISPLACED", []))
        # of a parallel robot there are functions with or without effects
        self._acts = effects is not None and (
            not self._closed or bool(self._effects.ADDED or self._effects.REMEMBERED)
        )
        self._driven = any(not native for _, _, native in getattr(self._effects, "DRIVES", []))
        #: what goes on from one record to the next, and its state where each record begins
        self.lasting: Dict[str, float] = dict(getattr(self._effects, "LASTING", []))
        self.begins: Dict[int, Dict[str, Any]] = {}
        #: whether something in it goes on by itself, so that a run needs a time before it
        self.remembers = self._model.nv > len(states) or bool(getattr(self._effects, "REMEMBERED", []))

    def _has(self, joint: str) -> bool:
        mj = self._mj
        return bool(mj.mj_name2id(self._model, mj.mjtObj.mjOBJ_JOINT, joint) >= 0)

    def _actuators(self) -> Optional[Array]:
        """Actuators in the order of the joints, where every joint has one."""
        found = []
        kind = self._mj.mjtTrn.mjTRN_TENDON if self._legs else self._mj.mjtTrn.mjTRN_JOINT
        for on in self._legs or [joint.id for joint in self._joints]:
            model = self._model
            own = np.flatnonzero((model.actuator_trnid[:, 0] == on) & (model.actuator_trntype == kind))
            if len(own) != 1:
                return None
            found.append(int(own[0]))
        return np.array(found)

    def inverse(self, q: Array, dq: Array, ddq: Array, dt: float, memory: Optional[Dict[str, Any]] = None) -> Array:
        """Torque that the drives report along a motion, ``(samples, joints)``; ``memory`` is carried on."""
        self._model.opt.timestep = self._own_step
        if self._effects is not None:
            if memory is not None:
                self._begin(memory, q[0])
            return np.asarray(self._effects.inverse(self._model, q, dq, ddq, dt, memory), float)
        mj, data = self._mj, self._mj.MjData(self._model)
        tau = np.zeros_like(q)
        for i in range(len(q)):
            data.qpos[self._at], data.qvel[self._dof], data.qacc[self._dof] = q[i], dq[i], ddq[i]
            mj.mj_inverse(self._model, data)
            tau[i] = data.qfrc_inverse[self._dof]
        out: Array = tau if self._drives is None else tau / self._gains()
        return out

    def closing(self, q: Array, dq: Array, ddq: Array, dt: float, memory: Optional[Dict[str, Any]] = None) -> Array:
        """As :meth:`inverse` for a parallel robot, along a motion of all joints of its tree."""
        model, count = self._model, len(q)
        self._model.opt.timestep = self._own_step
        states = [np.zeros((count, n)) for n in (model.nq, model.nv, model.nv)]
        for state, at, of in zip(states, (self._states_at, self._states_dof, self._states_dof), (q, dq, ddq)):
            state[:, at] = of[:, self._known]
        if memory is not None:
            self._begin(memory, q[0, self._of_drives])
        return np.asarray(self._effects.inverse(model, *states, dt, memory), float)

    def _begin(self, memory: Dict[str, Any], q: Array) -> None:
        """Starts a memory anew but for what lasts."""
        memory.update({**self._effects.start(q), **self._kept(memory)})

    def _kept(self, memory: Dict[str, Any]) -> Dict[str, Any]:
        """What a pause leaves of what lasts."""
        return {key: share * memory[key] for key, share in self.lasting.items() if key in memory}

    def _gains(self) -> Array:
        """Torque of every joint by the signal of its actuator."""
        gains: Array = self._model.actuator_gainprm[self._drives, 0] * self._model.actuator_gear[self._drives, 0]
        return gains

    def along(self, records: List[Any], joints: int) -> List[Array]:
        """``inverse`` along all records; what lasts goes from one to the next in the order of the experiment."""
        memory: Dict[str, Any] = {}
        out = {}
        for k in sorted(range(len(records)), key=lambda k: int(records[k]["order"])):
            r = records[k]
            self.begins[int(r["order"])] = self._kept(memory)
            if self._closed:
                x, v, a = (from_columns(r[f"tree_{n}"], len(self._tree)) for n in ("q", "dq", "ddq"))
                out[k] = self.closing(x, v, a, r["dt"], memory)
                continue
            q, dq, ddq = (from_columns(r[name], joints) for name in ("q", "dq", "ddq"))
            out[k] = self.inverse(q, dq, ddq, r["dt"], memory)
        return [out[k] for k in range(len(records))]

    def lasts(self, order: int, q: Array, dq: Array, dt: float) -> Dict[str, Any]:
        """State of what lasts behind the first samples of the record that is number ``order`` of the experiment."""
        effects = self._effects
        if effects is None or not self.lasting:
            return {}
        memory = {**effects.start(q[0] if len(q) else np.zeros(len(self._of_drives))), **self.begins.get(order, {})}
        for x, v in zip(q, dq):
            memory = effects.parts(x, v, np.zeros_like(x), dt, memory)[2]
        return {key: memory[key] for key in self.lasting}

    def run(
        self,
        q0: Array,
        dq0: Array,
        command: Command,
        dt: float,
        before: "Optional[Tuple[Command, Array, Array]]" = None,
        lasting: Optional[Dict[str, Any]] = None,
    ) -> Array:
        """Positions under a command, one row for each of its samples; the command ``before`` is played first, from a state
        of its own. ``lasting`` is the state of what lasts. States are those of all joints of the tree."""
        mj, effects = self._mj, self._effects
        # constraints that close loops are stiff: not slower than the file asks
        longest = min(STEP, self._own_step) if self._closed else STEP
        steps = max(int(math.ceil(dt / longest - 1e-9)), 1)
        self._model.opt.timestep = dt / steps
        data = mj.MjData(self._model)
        previous = mj.get_mjcb_passive()
        try:
            installed = effects.install(self._model) if self._acts else None
            self._set(data, *((q0, dq0) if before is None else before[1:]))
            if installed is not None and lasting:
                time, memory = installed.memory[data._address]
                installed.memory[data._address] = (time, {**memory, **lasting})
            if before is not None:
                self._play(data, before[0], steps)
                self._set(data, q0, dq0)
            return self._play(data, command, steps)
        finally:
            mj.set_mjcb_passive(previous)

    def _set(self, data: Any, q: Array, dq: Array) -> None:
        if self._effects is not None and self._displaced:
            zero = np.zeros_like(q)
            way, rate, _ = self._effects.displacement(q, dq, zero)
            q, dq = q + way, dq + rate
        data.qpos[self._states_at], data.qvel[self._states_dof] = q[self._known], dq[self._known]
        self._mj.mj_forward(self._model, data)
        if self._legs:
            self._zero = data.ten_length[self._legs] - q[self._of_drives]

    def _read(self, data: Any) -> "Tuple[Array, Array]":
        if self._legs:
            return data.ten_length[self._legs] - self._zero, data.ten_velocity[self._legs]
        q, dq = data.qpos[self._at], data.qvel[self._dof]
        if self._effects is not None and self._displaced:
            q = np.asarray(self._effects.encoder(q))
        return q, dq

    def _play(self, data: Any, command: Command, steps: int) -> Array:
        mj = self._mj
        late = np.zeros(len(self._of_drives))
        for j, seconds in getattr(self._effects, "DELAYED", []):
            late[j] = seconds
        out = np.empty_like(command.q)
        for i in range(command.steps + 1):
            q, dq = self._read(data)
            out[i] = q
            if not np.isfinite(q).all() or np.abs(q - command.q[i]).max() > 1e3:
                out[i:] = np.nan
                break
            for s in range(steps if i < command.steps else 0):
                t = (i + s / steps) * command.dt
                if s:
                    q, dq = self._read(data)
                tau = command(t, q, dq)
                for j in np.flatnonzero(late):
                    # what the log shows now was done a while ago
                    tau[j] += command.recorded(min(t + late[j], command.duration))[2][j] - command.recorded(t)[2][j]
                if self._effects is not None and self._driven:
                    tau = np.asarray(self._effects.command(tau))
                if self._drives is None:
                    data.qfrc_applied[self._dof] = tau
                else:
                    data.ctrl[self._drives] = tau
                mj.mj_step(self._model, data)
        return out
