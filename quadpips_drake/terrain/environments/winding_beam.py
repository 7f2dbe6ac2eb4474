"""Beams with bends: the straight line from start to goal leaves them."""

import numpy as np

from quadpips_drake.terrain.environments.beams import PIT_DEPTH
from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import PLATFORM_THICKNESS, ground_between, pit_floor
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Terrain, pose

_APRON, _APRON_WIDTH = 3.5, 3.0
"""Length and width of the ground before and behind the beam [m]."""
_FROM_EDGE = 1.2
"""Start and goal from the ends of the beam [m]."""


@takes_difficulty("aside", "how far the beam leads aside", "m", low=0.0, high=1.2)
def winding_balance_beam(*, seed: int = 0, aside: float = 0.6, width: float = 0.5) -> Terrain:
    """A beam of 0.5 m with four bends, around the straight line to the goal.

    It leads ``aside`` [m] to the left (by 37 degrees), straight on, and back; 3.6 m from platform to platform, ``width`` [m]
    wide.
    """
    points = [(0.0, 0.0), (0.6, 0.0), (1.4, aside), (2.2, aside), (3.0, 0.0), (3.6, 0.0)]
    return _winding("winding_balance_beam", points, width)


@takes_difficulty("aside", "how far the beam leads aside", "m", low=0.6, high=4.0)
def winding_balance_beam_hard(*, seed: int = 0, aside: float = 2.2, width: float = 0.5) -> Terrain:
    """A beam of 0.5 m with two right angles, 2.2 m aside.

    It leads 1.2 m ahead, ``aside`` [m] to the left and 1.2 m ahead again; ``width`` [m] wide.
    """
    points = [(0.0, 0.0), (1.2, 0.0), (1.2, aside), (2.4, aside)]
    return _winding("winding_balance_beam_hard", points, width)


def _winding(name: str, points: list[tuple[float, float]], width: float) -> Terrain:
    """A beam along ``points`` (x, y [m]), from ground before the first to ground behind the last."""
    (x_first, y_first), (x_last, y_last) = points[0], points[-1]
    sides = [y for _, y in points]
    span = max(sides) - min(sides) + _APRON_WIDTH
    elements = [
        ground_between("start_platform", x_first - _APRON, x_first, y_first, _APRON_WIDTH),
        ground_between("goal_platform", x_last, x_last + _APRON, y_last, _APRON_WIDTH),
        pit_floor(x_first - _APRON, x_last + _APRON, span, -PIT_DEPTH, 0.5 * (max(sides) + min(sides))),
        *_pieces(np.array(points), width),
    ]
    start, goal = (x_first - _FROM_EDGE, y_first, 0.0), (x_last + _FROM_EDGE, y_last)
    return Terrain(name, start, goal, DEFAULT_FRICTION, tuple(elements))


def _pieces(points: np.ndarray, width: float) -> list[Box]:
    """Boxes along a line of ``points`` (n, 2); at a bend they are so much longer that their outer corners meet."""
    steps = np.diff(points, axis=0)
    lengths, headings = np.linalg.norm(steps, axis=1), np.arctan2(steps[:, 1], steps[:, 0])
    longer = np.concatenate(([0.0], 0.5 * width * np.tan(0.5 * np.abs(np.diff(headings))), [0.0]))
    boxes = []
    for k, (length, heading) in enumerate(zip(lengths, headings, strict=True)):
        along = np.array([np.cos(heading), np.sin(heading)])
        middle = points[k] + 0.5 * (length + longer[k + 1] - longer[k]) * along
        size = (length + longer[k] + longer[k + 1], width, PLATFORM_THICKNESS)
        X_WE = pose((*middle, -0.5 * PLATFORM_THICKNESS), (0, 0, heading))
        boxes.append(Box(name=f"beam_{k}", size=size, X_WE=X_WE))
    return boxes
