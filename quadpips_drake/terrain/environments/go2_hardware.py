"""What the Go2 walked over in the laboratory: published are heights, slopes and stones; how long boards are is chosen."""

import math

from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import block, ground
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Terrain, pose

WIDTH = 1.6
"""Of all platforms [m]."""
INCLINE = math.radians(10.0)
"""Of the ramps [rad]."""
HEIGHT = 0.12
"""Of the first platform [m]."""
_FROM_EDGE = 1.2
"""Start and goal from what is to be crossed [m]."""
_BOARD = 0.02
"""Thickness of a ramp [m]."""
_height = takes_difficulty("height", "height of the first platform", "m", low=0.02, high=0.25)
_incline = takes_difficulty("incline", "slope of the ramps", "rad", low=0.05, high=0.6)


def go2_flat(*, seed: int = 0, radius: float = 1.0) -> Terrain:
    """Level ground; the goal lies to the left, across a circle of 1 m radius.

    The robot on hardware walked the circle, of ``radius`` [m], by goals of which this is the one halfway.
    """
    return Terrain("go2_flat", (0, 0, 0), (0, 2.0 * radius), DEFAULT_FRICTION, (ground(10.0),))


@_height
def go2_single_platform(*, seed: int = 0, height: float = HEIGHT) -> Terrain:
    """A platform of 12 cm, up and down again.

    It is 1.2 m long; ``height`` in m.
    """
    return _walk("go2_single_platform", 1.2, [block("platform", 0.0, 1.2, WIDTH, height)])


@_height
def go2_double_platform(*, seed: int = 0, height: float = HEIGHT, second: float = 0.05) -> Terrain:
    """A platform of 12 cm, then one of 5 cm.

    They are 1.2 and 1.0 m long and adjoin; ``height`` and ``second`` in m.
    """
    elements = [block("platform", 0.0, 1.2, WIDTH, height), block("second_platform", 1.2, 2.2, WIDTH, second)]
    return _walk("go2_double_platform", 2.2, elements)


@_incline
def go2_ramped_platform(*, seed: int = 0, incline: float = INCLINE) -> Terrain:
    """A ramp of 10 degrees up to a platform of 12 cm, and one down.

    The platform is 1.2 m long; ``incline`` in rad.
    """
    run = HEIGHT / math.tan(incline)
    elements = [
        _ramp("up", 0.0, incline, 1),
        block("platform", run, run + 1.2, WIDTH, HEIGHT),
        _ramp("down", 2 * run + 1.2, incline, -1),
    ]
    return _walk("go2_ramped_platform", 2 * run + 1.2, elements)


@takes_difficulty("rise", "height of the second platform above the first", "m", low=0.02, high=0.25)
def go2_triple_platform(*, seed: int = 0, rise: float = 0.13) -> Terrain:
    """A ramp of 10 degrees up to a platform of 12 cm, then steps of 13 and 10 cm up to 35 cm.

    The platforms are 0.8, 0.8 and 2.4 m long; the goal lies on the last. The second is ``rise`` [m] above the first.
    """
    run = HEIGHT / math.tan(INCLINE)
    second = HEIGHT + rise
    elements = [
        _ramp("up", 0.0, INCLINE, 1),
        block("platform", run, run + 0.8, WIDTH, HEIGHT),
        block("second_platform", run + 0.8, run + 1.6, WIDTH, second),
        block("third_platform", run + 1.6, run + 4.0, WIDTH, second + 0.10),
    ]
    return _walk("go2_triple_platform", run + 1.6, elements)


@takes_difficulty("spacing", "distance of the stones' centres", "m", low=0.2, high=0.6)
def go2_ramped_stones(*, seed: int = 0, spacing: float = 0.40, side: float = 0.20) -> Terrain:
    """A ramp of 10 degrees up to a platform of 12 cm, four stones of 20 cm, and down again.

    Two by two stones, ``side`` [m] wide and as high as the platforms before and behind them, stand on the ground ``spacing``
    [m] apart, as far from the platforms as from each other. The platforms are 0.8 m long.
    """
    run = HEIGHT / math.tan(INCLINE)
    near = run + 0.8
    first = near + spacing - 0.5 * side
    far = first + 2 * spacing - 0.5 * side
    elements = [_ramp("up", 0.0, INCLINE, 1), block("platform", run, near, WIDTH, HEIGHT)]
    for row in range(2):
        for column in range(2):
            center = (first + spacing * row, spacing * (column - 0.5), 0.5 * HEIGHT)
            elements.append(Box(name=f"stone_{row}_{column}", size=(side, side, HEIGHT), X_WE=pose(center)))
    elements += [block("far_platform", far, far + 0.8, WIDTH, HEIGHT), _ramp("down", far + 0.8 + run, INCLINE, -1)]
    return _walk("go2_ramped_stones", far + 0.8 + run, elements)


def _ramp(name: str, foot: float, incline: float, direction: int) -> Box:
    """A board that rises from the ground at x = ``foot`` [m] to HEIGHT, in +x (``direction`` 1) or -x (-1)."""
    length = HEIGHT / math.sin(incline)
    # From the middle of the upper face half the board's thickness into it.
    x = foot + direction * (0.5 * length * math.cos(incline) + 0.5 * _BOARD * math.sin(incline))
    z = 0.5 * HEIGHT - 0.5 * _BOARD * math.cos(incline)
    return Box(name=name, size=(length, WIDTH, _BOARD), X_WE=pose((x, 0, z), (0, -direction * incline, 0)))


def _walk(name: str, length: float, elements: list[Box]) -> Terrain:
    """``elements`` on the ground from x = 0 to ``length`` [m], with a start before and a goal behind them."""
    start, goal = (-_FROM_EDGE, 0, 0), (length + _FROM_EDGE, 0)
    return Terrain(name, start, goal, DEFAULT_FRICTION, (ground(2.0 * (length + 4.0)), *elements))
