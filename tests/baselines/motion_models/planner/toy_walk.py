"""A walk that does to the letter what motion models say, seen at 200 Hz: to try the planner without a simulation."""

from dataclasses import replace

import numpy as np

from quadpips_drake.baselines.motion_models.exchange import SAMPLE_RATE
from quadpips_drake.baselines.motion_models.models import MotionModels
from quadpips_drake.baselines.motion_models.planner.velocity_planning import PlanningMemory, VelocityPlanning
from quadpips_drake.baselines.motion_models.state import PAIRS
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import SafetyStatus
from tests.baselines.motion_models.planner.worlds import STEP, standing

RADIUS = 0.02


class ToyRobot:
    """Its feet are where its joint positions say, as x, y, z in W."""

    def foot_positions_W(self, state: RobotState) -> np.ndarray:
        return state.joint_positions.reshape(4, 3)

    def soles_W(self, feet: np.ndarray) -> np.ndarray:
        return feet - [0.0, 0.0, RADIUS]


class ToyWalk:
    """While a gait is commanded, a step begins every STEP seconds; base and feet move at once when it ends."""

    def __init__(self, planning: VelocityPlanning, models: MotionModels, *, y: float = 0.0, error: float = 0.0):
        """Args: who commands it; what it does; where it starts; how much further than that the feet come down [m]."""
        self.planning, self.memory, self._models, self._error = planning, PlanningMemory(), models, error
        self.step, self.time = standing(0.0, y), 0.0
        self._changes = np.inf
        """When the first step begins or the present one ends [s]."""
        self._walks = False
        self.footholds: list[np.ndarray] = []
        """Where feet came down, x, y in W."""
        self.commands: list[np.ndarray] = []

    def walk(self, duration: float, goal, costmap, safety: SafetyStatus | None = None, until=lambda memory: False) -> None:
        """Goes on for ``duration`` [s] or ``until`` something is in the memory; ``costmap``: function of the time."""
        safety = safety or SafetyStatus.empty()
        for _ in range(round(duration * SAMPLE_RATE)):
            self._advance()
            now, goal = self.time, np.array(goal, dtype=float)
            self.memory = self.planning.update(self.memory, self.state(), goal, safety, lambda now=now: costmap(now))
            if until(self.memory):
                return

    def _advance(self) -> None:
        self.time += 1.0 / SAMPLE_RATE
        if self.memory.gait == "stance":
            self._changes, self._walks = np.inf, False
            self.step = replace(self.step, velocity=np.zeros(2), previous_velocity=np.zeros(2))
        elif self._changes == np.inf:
            self._changes = self.time + STEP
        elif self.time >= self._changes:
            self._changes += STEP
            if self._walks:
                self._end_step(self.memory.command)
            self._walks = True

    def _end_step(self, command: np.ndarray) -> None:
        outputs = self._models.predict(self.step.inputs(command), self.step.swing)
        outputs[[2, 4]] += self._error
        self.commands.append(command)
        self.step = self.step.after(command, outputs)
        self.footholds += [self.step.feet_W[leg] for leg in PAIRS[1 - self.step.swing]]

    def state(self) -> RobotState:
        """What is measured; the pair that swings is off the ground."""
        contacts = np.ones(4, bool)
        if self._walks:
            contacts[list(PAIRS[self.step.swing])] = False
        return replace(
            RobotState.empty(),
            stamp=self.time,
            p_WB=np.array([*self.step.position, 0.5]),
            rpy_WB=np.array([0.0, 0.0, self.step.yaw]),
            v_WB=np.array([*self.step.velocity, 0.0]),
            contacts=contacts,
            joint_positions=np.column_stack((self.step.feet_W, np.full(4, RADIUS))).ravel(),
        )
