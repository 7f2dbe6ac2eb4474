"""What a robot that walks by velocity command does from step to step, seen from outside: by its state alone."""

from dataclasses import dataclass, field, replace

import numpy as np

from quadpips_drake.baselines.motion_models.exchange import NOBODY, ExchangeMemory, look_for_exchange
from quadpips_drake.baselines.motion_models.state import StepState, measured_step_state
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.robot_state import RobotState


@dataclass(frozen=True, eq=False)
class StepWatch(ImmutableValue):
    """Where a walk stands; begins as ``StepWatch()``."""

    exchange: ExchangeMemory = field(default_factory=ExchangeMemory)
    """What finding steps remembers."""
    state: StepState | None = None
    """At the beginning of the present step; None while the robot stands."""
    out_of_standing: bool = True
    """Whether the present step is the first one after standing."""


def watch_steps(watch: StepWatch, state: RobotState, feet_W: np.ndarray, command: np.ndarray) -> tuple[StepWatch, bool]:
    """The watch after one more look, and whether a step begins now: then its ``state`` is that of this moment.

    Args:
        watch: after the last look.
        state: as measured, SAMPLE_RATE (``exchange``) after the last one.
        feet_W: centres of the feet in W [m], (4, 3).
        command: forward, left [m/s], yaw rate [rad/s], as commanded during the step that may end now, (3,).
    """
    exchange, begins = look_for_exchange(watch.exchange, state.stamp, state.contacts)
    if not begins:
        return replace(watch, exchange=exchange, state=None if exchange.swing == NOBODY else watch.state), False
    before = watch.state
    now = measured_step_state(state, feet_W, exchange.swing, before, np.zeros(3) if before is None else command)
    return StepWatch(exchange, now, out_of_standing=before is None), True
