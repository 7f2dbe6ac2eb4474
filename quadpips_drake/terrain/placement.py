"""Can a robot stand at the start, and is there ground to walk on at the goal?"""

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.truth import GroundTruth

DEFAULT_FOOTPRINT = np.array([[0.0, 0.0], [0.37, 0.2], [0.37, -0.2], [-0.37, 0.2], [-0.37, -0.2]])
"""Base and feet of ANYmal C at its nominal stance, x and y in the base frame [m], (5, 2)."""


def problem_with_start(terrain: Terrain, footprint=None, max_step: float = 0.25) -> str | None:
    """Says in one line why a robot cannot stand at the terrain's start, or returns None.

    Under each point of ``footprint`` (x, y in the base frame [m], (n, 2); by default ANYmal C's stance) there must be ground
    that feet may use, and its heights must not differ by more than ``max_step`` [m].
    """
    footprint = DEFAULT_FOOTPRINT if footprint is None else np.asarray(footprint, float)
    x, y, yaw = terrain.start
    points = np.array([x, y]) + footprint @ yaw_matrix(yaw)[:2, :2].T
    truth = GroundTruth(terrain)
    where = f"start ({x:g}, {y:g}) of terrain '{terrain.name}'"
    for px, py in points:
        reason = _no_ground(truth, px, py)
        if reason:
            return (
                f"{where}: the robot would stand at ({px:.2f}, {py:.2f}), where {reason}; choose a start on walkable ground"
            )
    heights = truth.height(*points.T)
    if np.ptp(heights) > max_step:
        return f"{where}: the ground under the feet differs by {np.ptp(heights):.2f} m; choose a more level start"
    return None


def problem_with_goal(terrain: Terrain) -> str | None:
    """Says in one line why the terrain's goal cannot be walked to, or returns None."""
    x, y = terrain.goal
    reason = _no_ground(GroundTruth(terrain), x, y)
    if reason:
        return f"goal ({x:g}, {y:g}) of terrain '{terrain.name}' lies where {reason}; choose a goal on walkable ground"
    return None


def check_start_and_goal(terrain: Terrain, footprint=None, max_step: float = 0.25):
    """Raises UserInputError with the reason if the robot cannot stand at the start or not walk to the goal."""
    problem = problem_with_start(terrain, footprint, max_step) or problem_with_goal(terrain)
    if problem:
        raise UserInputError(problem)


def _no_ground(truth: GroundTruth, x: float, y: float) -> str | None:
    index = int(truth.element(x, y))
    if index < 0:
        return "there is nothing (off the terrain)"
    element = truth.terrain.elements[index]
    return None if element.is_walkable else f"there is only {element.title}, which is {element.label.name.lower()}"
