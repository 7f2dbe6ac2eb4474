"""When a trial is over, and how it went (the rules that every planner is judged by)."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.terrain.terrain import GOAL_TOLERANCE, Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.robot_state import RobotState


@configuration
class JudgeConfig:
    """Limits of a trial."""

    goal_tolerance: float = ranged(GOAL_TOLERANCE, 0.001, 100.0)
    """Distance of the torso to the goal in xy that counts as reached [m]."""
    goal_hold_time: float = ranged(0.5, 0.0, 1000.0)
    """How long the torso must stay there, upright [s]."""
    max_tilt: float = ranged(0.8, 0.01, 3.2)
    """Roll or pitch beyond which the robot has fallen [rad]."""
    max_foot_drop: float = ranged(0.15, 0.001, 100.0)
    """A foot this far below the terrain elements around it has left the terrain [m]."""


@dataclass(frozen=True)
class Verdict:
    """The end of a trial."""

    reason: str
    detail: str


class TrialJudge:
    """Watches a trial sample by sample; memory is only how long the torso has been at the goal."""

    def __init__(self, terrain: Terrain, config: JudgeConfig, *, has_goal: bool = True):
        """Args: the world; limits; whether reaching the terrain's goal ends the trial."""
        self._truth = GroundTruth(terrain)
        self._goal, self._config = np.asarray(terrain.goal, dtype=float), config
        self._has_goal = has_goal
        self._at_goal_since: float | None = None

    def look_at(self, terrain: Terrain) -> None:
        """The world is this one from now on."""
        self._truth = GroundTruth(terrain)

    def move_goal(self, goal) -> None:
        """The goal is at ``goal``, x, y [m], from now on."""
        self._goal, self._at_goal_since = np.asarray(goal, dtype=float), None

    def distance_to_goal(self, state: RobotState) -> float:
        """Horizontal distance of the torso to the goal [m]."""
        return float(np.linalg.norm(state.p_WB[:2] - self._goal))

    def __call__(self, state: RobotState, foot_bottoms: np.ndarray, body_touches: bool) -> Verdict | None:
        """Judges one sample.

        Args:
            state: the true state.
            foot_bottoms: lowest points of the feet in W [m], (4, 3).
            body_touches: whether the torso touches anything.

        Returns: the verdict, or None while the trial goes on.
        """
        config = self._config
        tilt = float(np.abs(state.rpy_WB[:2]).max())
        if not np.isfinite(state.p_WB).all():
            return Verdict("error", "the simulated state is not finite")
        if tilt > config.max_tilt:
            return Verdict("fell", f"roll or pitch reached {tilt:.2f} rad")
        if body_touches:
            return Verdict("fell", "the torso touched the ground")
        drops = self._truth.nearest_walkable_height(foot_bottoms[:, 0], foot_bottoms[:, 1]) - foot_bottoms[:, 2]
        if drops.max() > config.max_foot_drop:
            x, y = foot_bottoms[drops.argmax(), :2]
            return Verdict("left_terrain", f"a foot is {drops.max():.2f} m below the terrain at ({x:.2f}, {y:.2f})")
        if not self._has_goal or self.distance_to_goal(state) > config.goal_tolerance:
            self._at_goal_since = None
        elif self._at_goal_since is None:
            self._at_goal_since = state.stamp
        elif state.stamp - self._at_goal_since >= config.goal_hold_time - 1e-9:
            return Verdict("goal_reached", f"{self.distance_to_goal(state):.2f} m from the goal")
        return None
