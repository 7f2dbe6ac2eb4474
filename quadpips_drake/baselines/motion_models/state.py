"""The robot between two steps, in the plane: what the motion models take in and give out, and the step from one to the next.

Equations (1) to (5) of Taouil et al. A step goes from one exchange of the feet to the next; during it one diagonal pair of
feet swings. B is the heading frame: at the base's origin, turned with its yaw alone (on inclined ground, too). The paper's
CoM is the base's origin here.
"""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import Leg

PAIRS = ((Leg.LF, Leg.RH), (Leg.RF, Leg.LH))
"""The feet that swing together, (fore, hind); a ``swing`` is an index into this."""

VELOCITY, PREVIOUS_VELOCITY = slice(0, 2), slice(2, 4)
"""Inputs: forward, left velocity of the base at this exchange and at the one before, each in its own heading frame [m/s]."""
COMMAND, PREVIOUS_COMMAND = slice(4, 6), slice(6, 8)
"""Inputs: forward, left velocity commanded for the coming step and for the last one [m/s]."""
FEET = slice(8, 16)
"""Inputs: x, y of the feet LF, RF, LH, RH from the base's origin, in B [m]."""
CONSTANT = 16
"""Input: 1. The 16 before it are x^t of equation (2); those after it are zero where nothing turns."""
TURN = slice(17, 21)
"""Inputs: yaw rate at this exchange and at the one before, commanded for the coming step and for the last one [rad/s]."""
INPUTS = 21

BASE_SHIFT = slice(0, 2)
"""Outputs: displacement of the base (CDM), in B at the beginning of the step [m]."""
FEET_SHIFT = slice(2, 6)
"""Outputs: displacement of the fore and of the hind swing foot (FDM): x, y, x, y, in B at the beginning of the step [m]."""
NEXT_VELOCITY = slice(6, 8)
"""Outputs: velocity of the base at the next exchange (CVM), in the heading frame then [m/s]."""
OUTPUTS = 8

_MIRRORED_LEGS = [Leg.RF, Leg.LF, Leg.RH, Leg.LH]
_FORWARD_LEFT = np.array([1.0, -1.0])
MIRRORED_INPUTS = np.array(
    [*range(8), *(FEET.start + 2 * leg + axis for leg in _MIRRORED_LEGS for axis in range(2)), *range(CONSTANT, INPUTS)]
)
"""Left and right swapped: ``inputs[..., MIRRORED_INPUTS] * INPUT_SIGNS`` is what a mirror shows."""
INPUT_SIGNS = np.concatenate((np.tile(_FORWARD_LEFT, 8), [1.0], np.full(4, -1.0)))
OUTPUT_SIGNS = np.tile(_FORWARD_LEFT, 4)
"""Of the outputs in a mirror, where the other pair swings: fore stays fore, so that signs are all."""


def mirrored_inputs(inputs: np.ndarray) -> np.ndarray:
    """Inputs (..., INPUTS) as in a mirror that swaps left and right."""
    return inputs[..., MIRRORED_INPUTS] * INPUT_SIGNS


def mirrored_outputs(outputs: np.ndarray) -> np.ndarray:
    """Outputs (..., OUTPUTS) as in a mirror that swaps left and right; the other pair swings in it."""
    return outputs * OUTPUT_SIGNS


@dataclass(frozen=True, eq=False)
class StepState(ImmutableValue):
    """Equation (1), s^t without the coming command: robot and feet at an exchange, and what is left of the last step."""

    position: np.ndarray
    """x, y of the base's origin in W [m], (2,)."""
    yaw: float
    """[rad]"""
    velocity: np.ndarray
    """Forward, left [m/s], (2,)."""
    previous_velocity: np.ndarray
    """The same at the exchange before, in the heading frame then, (2,)."""
    previous_command: np.ndarray
    """Forward, left [m/s], yaw rate [rad/s] that was commanded for the last step, (3,)."""
    feet: np.ndarray
    """x, y of the feet LF, RF, LH, RH from the base's origin, in B [m], (4, 2): the paper's b_pbar_foot."""
    swing: int
    """Which of PAIRS swings in the coming step."""
    yaw_rate: float = 0.0
    """[rad/s]"""
    previous_yaw_rate: float = 0.0
    """At the exchange before [rad/s]."""

    @property
    def feet_W(self) -> np.ndarray:
        """x, y of the feet in W [m], (4, 2)."""
        return self.position + self.feet @ yaw_matrix(self.yaw)[:2, :2].T

    def inputs(self, command: np.ndarray) -> np.ndarray:
        """What the models take in, equation (2), (INPUTS,), when ``command`` is given: forward, left, yaw rate, (3,)."""
        x = np.empty(INPUTS)
        x[VELOCITY], x[PREVIOUS_VELOCITY] = self.velocity, self.previous_velocity
        x[COMMAND], x[PREVIOUS_COMMAND] = command[:2], self.previous_command[:2]
        x[FEET], x[CONSTANT] = self.feet.ravel(), 1.0
        x[TURN] = self.yaw_rate, self.previous_yaw_rate, command[2], self.previous_command[2]
        return x

    def after(self, command: np.ndarray, outputs: np.ndarray) -> "StepState":
        """The state at the next exchange: equations (3) to (5) with what the models gave out, (OUTPUTS,), for ``command``.

        Yaw and yaw rate stay as they are: the models do not tell them.
        """
        R_WB = yaw_matrix(self.yaw)[:2, :2]
        feet_W = self.feet_W
        feet_W[list(PAIRS[self.swing])] += outputs[FEET_SHIFT].reshape(2, 2) @ R_WB.T
        position = self.position + R_WB @ outputs[BASE_SHIFT]
        return replace(
            self,
            position=position,
            velocity=outputs[NEXT_VELOCITY].copy(),
            previous_velocity=self.velocity,
            previous_command=np.array(command, dtype=float),
            feet=(feet_W - position) @ R_WB,
            swing=1 - self.swing,
            previous_yaw_rate=self.yaw_rate,
        )


def measured_step_state(state, feet_W: np.ndarray, swing: int, before: StepState | None, command: np.ndarray) -> StepState:
    """The state at an exchange, from what the robot measures.

    Args:
        state: RobotState.
        feet_W: centres of its feet in W [m], (4, 3).
        swing: which of PAIRS swings next.
        before: the state at the exchange before; None: the robot has stood still.
        command: forward, left [m/s], yaw rate [rad/s] of the step that ends here, (3,); zero where there was none.
    """
    yaw = float(state.rpy_WB[2])
    R_WB = yaw_matrix(yaw)[:2, :2]
    position = state.p_WB[:2]
    return StepState(
        position=position.copy(),
        yaw=yaw,
        velocity=state.v_WB[:2] @ R_WB,
        previous_velocity=np.zeros(2) if before is None else before.velocity,
        previous_command=np.array(command, dtype=float),
        feet=(feet_W[:, :2] - position) @ R_WB,
        swing=swing,
        yaw_rate=float(state.w_WB[2]),
        previous_yaw_rate=0.0 if before is None else before.yaw_rate,
    )


def measured_outputs(now: StepState, then: StepState) -> np.ndarray:
    """What the models should have given out for the step from ``now`` to ``then``, (OUTPUTS,): (3) to (5) backwards."""
    R_WB = yaw_matrix(now.yaw)[:2, :2]
    swung = list(PAIRS[now.swing])
    outputs = np.empty(OUTPUTS)
    outputs[BASE_SHIFT] = (then.position - now.position) @ R_WB
    outputs[FEET_SHIFT] = ((then.feet_W[swung] - now.feet_W[swung]) @ R_WB).ravel()
    outputs[NEXT_VELOCITY] = then.velocity
    return outputs
