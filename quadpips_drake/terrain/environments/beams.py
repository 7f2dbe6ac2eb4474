"""Straight beams over a pit: one, one beside the way, two side by side, and one with barriers on it."""

import math

from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import PLATFORM_THICKNESS, pit_floor, platform
from quadpips_drake.terrain.environments.views import wants_cameras
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Terrain, pose
from quadpips_drake.values.steppability import Steppability

LENGTH = 2.0
"""From platform to platform [m]."""
PIT_DEPTH = 0.95
"""Of the original worlds [m]."""


@takes_difficulty("width", "width of the beam", "m", low=0.08, high=1.0, larger_is_harder=False)
def balance_beam(*, seed: int = 0, width: float = 0.5) -> Terrain:
    """A beam of 0.5 m over a pit, straight ahead.

    It is 2 m long and ``width`` [m] wide.
    """
    return _over_a_pit("balance_beam", (-3.0, 0, 0), (2.0, 0), [_beam("beam", 0.0, width)])


@takes_difficulty("offset", "distance of the beam from the straight line", "m", low=0.0, high=1.5)
def offset_beam(*, seed: int = 0, offset: float = 0.75) -> Terrain:
    """A beam of 0.5 m over a pit, beside the straight line to the goal.

    It is 2 m long; start and goal lie ``offset`` [m] to its left.
    """
    return _over_a_pit("offset_beam", (-3.0, offset, 0), (2.0, offset), [_beam("beam", 0.0, 0.5)])


@wants_cameras("left", "right")
@takes_difficulty("width", "width of a beam", "m", low=0.08, high=0.4, larger_is_harder=False)
def parallel_beams(*, seed: int = 0, width: float = 0.2, separation: float = 0.85) -> Terrain:
    """Two narrow beams side by side, as far apart as ANYmal C is long: to be crossed sideways.

    They are 2 m long and ``width`` [m] wide; their middle lines are ``separation`` [m] apart.
    """
    beams = [_beam("left_beam", 0.5 * separation, width), _beam("right_beam", -0.5 * separation, width)]
    return _over_a_pit("parallel_beams", (-2.5, 0.15, 0), (2.0, 0.15), beams)


@takes_difficulty("height", "height of the barriers", "m", low=0.02, high=0.25)
def obstructed_balance_beam(*, seed: int = 0, height: float = 0.12, barriers: int = 3, width: float = 0.5) -> Terrain:
    """A beam of 0.5 m with tilted barriers that a foot must not use.

    The barriers lie across the beam, 8 cm long and labelled passable; each rises from one edge of the beam to ``height`` [m]
    at the other, the first to the left, the next to the right and so on. They divide the beam, which is 2 m long, evenly.
    """
    beam = _beam("beam", 0.0, width)
    tilt = math.atan2(height, width)
    elements = [beam]
    for k in range(barriers):
        side = 1 if k % 2 == 0 else -1
        x = LENGTH * ((k + 1) / (barriers + 1) - 0.5)
        # Its upper face reaches from edge to edge of the beam; it is as thick as it is high, so that nothing is open below.
        center = (x, 0.5 * height * math.sin(tilt) * side, 0.5 * height - 0.5 * height * math.cos(tilt))
        size = (0.08, width / math.cos(tilt), height)
        X_WE = pose(center, (side * tilt, 0, 0))
        elements.append(Box(name=f"barrier_{k}", size=size, X_WE=X_WE, label=Steppability.PASSABLE))
    return _over_a_pit("obstructed_balance_beam", (-3.0, 0, 0), (2.0, 0), elements)


def _beam(name: str, y: float, width: float) -> Box:
    return Box(name=name, size=(LENGTH, width, PLATFORM_THICKNESS), X_WE=pose((0, y, -0.5 * PLATFORM_THICKNESS)))


def _over_a_pit(name: str, start, goal, elements: list[Box]) -> Terrain:
    """``elements`` between two platforms, over a floor."""
    half, outer, width = 0.5 * LENGTH, 0.5 * LENGTH + 4.0, 6.0
    ends = [platform("start_platform", -outer, -half, width), platform("goal_platform", half, outer, width)]
    return Terrain(name, start, goal, DEFAULT_FRICTION, (*ends, pit_floor(-outer, outer, width, -PIT_DEPTH), *elements))
