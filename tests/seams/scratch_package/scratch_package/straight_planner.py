"""A planner that looks at nothing and walks straight towards the goal."""

from dataclasses import dataclass, field

import numpy as np

import quadpips_drake as qp
from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig, VelocityWalk, WalkMemory
from quadpips_drake.gaits.gaits import load_gait


@dataclass
class StraightConfig(qp.StageConfig):
    """How it walks."""

    rate: float = 50.0
    """How often it looks where it is [Hz]."""
    speed: float = 0.25
    """[m/s]"""
    turning: float = 0.5
    """Yaw rate for each radian that the goal lies to the side [1/s]."""
    tolerance: float = 0.2
    """It stops this close to the goal [m]."""
    patience: float = 1000.0
    """It gives up when it has not arrived after this time [s]."""


@dataclass(frozen=True, eq=False)
class StraightMemory:
    """The walk so far, and what the world was told about it."""

    walk: WalkMemory = field(default_factory=WalkMemory.empty)
    status: qp.PlannerStatus = field(default_factory=qp.PlannerStatus.empty)


class StraightPlanner(qp.Stage):
    """Walks in a straight line, by velocity."""

    def __init__(self, setup: qp.PlannerSetup):
        super().__init__("straight_planner", setup.config, memory=StraightMemory(), timings=setup.timings)
        self._walk = VelocityWalk(setup.robot, VelocityReferenceConfig(max_acceleration=1.0))
        self.declare_input("robot_state", qp.RobotState)
        self.declare_vector_input("goal", 2)
        self.declare_output("reference", qp.WholeBodyReference, lambda memory: memory.walk.reference)
        self.declare_output("status", qp.PlannerStatus, lambda memory: memory.status)

    def update(self, inputs, memory: StraightMemory, time: float) -> StraightMemory:
        """One step of the walk."""
        state = inputs.robot_state
        if not state.is_known:  # the estimator has said nothing yet
            return memory
        way = inputs.goal - state.p_WB[:2]
        distance = float(np.hypot(*way))
        there, too_late = distance < self.config.tolerance, time > self.config.patience
        side = np.arctan2(way[1], way[0]) - state.rpy_WB[2]
        side = float(np.arctan2(np.sin(side), np.cos(side)))
        command = np.zeros(3) if there or too_late else np.array([self.config.speed, 0.0, self.config.turning * side])
        walk = self._walk.update(memory.walk, state, command, load_gait("stance" if there or too_late else "trot"))
        phase = qp.PlannerPhase.GOAL_REACHED if there else qp.PlannerPhase.NO_PLAN if too_late else qp.PlannerPhase.WALKING
        reason = "out of patience" if too_late else "straight ahead"
        status = qp.PlannerStatus(time, phase, reason, fallbacks={"thoughts": 0}, distance_to_goal=distance)
        return StraightMemory(walk, status)


ENTRY = qp.Entry(StraightPlanner, StraightConfig, "walks straight towards the goal")
