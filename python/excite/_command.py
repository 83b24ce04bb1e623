"""What a simulator is told: the recorded torques, and how the robot's controller answers a deviation."""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from ._arrays import Array
from ._robot import Robot

#: Natural frequency of the spring where the controller is not known, Hz; as in the diagnosis.
SOFT = 2.0


class Command:
    """The command of one run, a function ``(t, q, dq) -> torque``.

    ``t`` is the time since the start of the run (s) and does not decrease from call to call; ``q`` and ``dq`` are the
    simulated positions and velocities ``(joints,)``. Gives the torque of the drives, N m or N, ``(joints,)``:

        tau(t) - K_p (q - q_log) - K_d (dq - dq_log) - K_i int (q - q_log) dt

    With the gains of the robot's own controller, where the log tells them, this is what that controller sends under the
    same commanded positions; otherwise they are those of a soft spring and damper.
    """

    def __init__(self, q: Array, dq: Array, tau: Array, dt: float, gains: "Tuple[Array, Array, Array]") -> None:
        #: recorded positions, ``(samples, joints)``
        self.q = q
        #: recorded velocities
        self.dq = dq
        #: recorded torques
        self.tau = tau
        #: time between samples, s
        self.dt = dt
        #: how many steps the run has; a trajectory has one row more
        self.steps = len(q) - 1
        self._gains = gains
        self._sum: Array = np.zeros(q.shape[1])
        self._last = 0.0

    @property
    def duration(self) -> float:
        """Duration of the run, s."""
        return self.steps * self.dt

    def recorded(self, t: float) -> "Tuple[Array, Array, Array]":
        """Positions, velocities and torques of the log at a time; cubic between the samples, torques linear."""
        i = min(max(int(t / self.dt), 0), max(self.steps - 1, 0))
        w, h = t / self.dt - i, self.dt
        j = min(i + 1, self.steps)
        a, b, u, v = self.q[i], self.q[j], h * self.dq[i], h * self.dq[j]
        q = a + w * (u + w * (3 * (b - a) - 2 * u - v + w * (2 * (a - b) + u + v)))
        return q, (1 - w) * self.dq[i] + w * self.dq[j], (1 - w) * self.tau[i] + w * self.tau[j]

    def __call__(self, t: float, q: Any, dq: Any) -> Array:
        at, rate, tau = self.recorded(t)
        off = np.asarray(q, float) - at
        self._sum = self._sum + off * max(t - self._last, 0.0)
        self._last = t
        k = min(max(int(round(t / self.dt)), 0), self.steps)
        kp, kd, ki = (g[k] for g in self._gains)
        answer: Array = tau - kp @ off - kd @ (np.asarray(dq, float) - rate) - ki @ self._sum
        return answer


class Feedback:
    """How deviations are answered along a record."""

    def __init__(self, forward: Dict[str, Any]) -> None:
        known: Optional[Dict[str, Any]] = forward.get("controller")
        self._kind = "soft" if known is None else str(known["kind"])
        omega = 2 * np.pi * float(forward.get("bandwidth", SOFT))
        soft = [[omega**2, 2 * omega, 0.0]]
        self._gains = np.array(soft if known is None else known["gains"], dtype=float)
        #: in words
        self.words = {
            "soft": f"recorded torques, held by a soft spring of {forward.get('bandwidth', SOFT):g} Hz",
            "actuators": "the recorded commands, under the controller that the log shows",
            "inverse_dynamics": "the recorded commands, under the inverse-dynamics controller that the log shows",
        }.get(self._kind, self._kind)

    def along(self, inertia: Array) -> "Tuple[Array, Array, Array]":
        """Gains at every sample, each ``(samples, joints, joints)``, from the mass matrix there."""
        if self._kind == "actuators":
            parts = [np.broadcast_to(np.diag(self._gains[:, k]), inertia.shape) for k in range(3)]
        else:
            parts = [inertia * self._gains[0, k] for k in range(3)]
        return parts[0], parts[1], parts[2]


def stiff(inertia: Array, frequency: float) -> "Tuple[Array, Array, Array]":
    """Gains that hold a model to the record, for the time before a run."""
    omega = 2 * np.pi * frequency
    return inertia * omega**2, inertia * 2 * omega, 0 * inertia


def mass(robot: Robot, q: Array) -> Array:
    """Nominal torques of the joints by the accelerations of the coordinates, ``(samples, joints, coordinates)``: the mass
    matrix of a serial robot."""
    still = robot.torque(q)
    rows: List[Array] = []
    for j in range(q.shape[1]):
        push = np.zeros_like(q)
        push[:, j] = 1.0
        rows.append(robot.torque(q, None, push) - still)
    return np.stack(rows, axis=-1)
