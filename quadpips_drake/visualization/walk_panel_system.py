"""WalkPanel: commands for a walk from sliders and buttons in Meshcat, or from a gamepad."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat

from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.gaits.gaits import GAITS

SLIDERS = {"forward [m/s]": 0.8, "left [m/s]": 0.4, "turn [rad/s]": 0.8}
"""Name and largest value of each component of the velocity command."""
_STEPS = (0.05, 0.05, 0.05)
_DEAD_BAND = 0.1
"""Deflection of a gamepad's stick that counts as none."""
_GAMEPAD_AXES = (1, 0, 2)
"""Of forward, left and turn; sticks count to the right and downwards."""


class WalkPanel(LeafSystem):
    """Reads gait and velocity from Meshcat: sliders, one button per gait, and the browser's gamepad while it is deflected.

    Like every input device it is not a function of time and context; a walk with a panel is not reproducible.

    .. pydrake_system::

        name: WalkPanel
        output_ports:
        - velocity_command
        - gait

    - velocity_command: vector (3,): forward, left [m/s], yaw rate [rad/s] in the heading frame of the robot. Updated at
      1 / ``period``.
    - gait: str, name of the gait whose button was pressed last. Updated at 1 / ``period``.
    """

    def __init__(self, meshcat: Meshcat, initial: WalkCommand, *, period: float = 0.05):
        """Args: where to draw the panel; what holds until somebody touches it; sampling period [s]."""
        super().__init__()
        self.set_name("command")
        self._meshcat = meshcat
        for (name, bound), value, step in zip(SLIDERS.items(), initial.velocity, _STEPS, strict=True):
            meshcat.AddSlider(name, -bound, bound, step, float(np.clip(value, -bound, bound)))
        for gait in GAITS:
            meshcat.AddButton(gait)
        velocity = self.DeclareDiscreteState(np.asarray(initial.velocity, dtype=float))
        self._gait = self.DeclareAbstractState(AbstractValue.Make((initial.gait, (0,) * len(GAITS))))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        self.DeclareStateOutputPort("velocity_command", velocity)
        self.DeclareAbstractOutputPort(
            "gait",
            lambda: AbstractValue.Make(initial.gait),
            lambda context, output: output.set_value(self._memory(context)[0]),
            {self.abstract_state_ticket(self._gait)},
        )

    def _memory(self, context) -> tuple[str, tuple[int, ...]]:
        """The present gait, and how often each button had been pressed."""
        return context.get_abstract_state(int(self._gait)).get_value()

    def _update(self, context, state):
        gait, before = self._memory(context)
        clicks = tuple(self._meshcat.GetButtonClicks(name) for name in GAITS)
        pressed = [name for name, old, new in zip(GAITS, before, clicks, strict=True) if new > old]
        state.get_mutable_abstract_state(int(self._gait)).set_value((pressed[-1] if pressed else gait, clicks))
        state.get_mutable_discrete_state().get_mutable_vector(0).SetFromVector(self._velocity())

    def _velocity(self) -> np.ndarray:
        bounds = np.array(list(SLIDERS.values()))
        gamepad = self._meshcat.GetGamepad()
        if gamepad.index is not None and len(gamepad.axes) > max(_GAMEPAD_AXES):
            deflection = -np.array([gamepad.axes[axis] for axis in _GAMEPAD_AXES])
            if np.abs(deflection).max() > _DEAD_BAND:
                return bounds * np.where(np.abs(deflection) > _DEAD_BAND, deflection, 0.0)
        return np.array([self._meshcat.GetSliderValue(name) for name in SLIDERS])
