"""A trench between two platforms; courses of narrow gaps and low steps, as in arXiv 2307.12292 (Taouil et al.).

The paper tells how wide the gaps are, how high the steps and in which order they come. Distances, depth, widths of the
ground and what lies between left and right of an asymmetrical gap are chosen here.
"""

from dataclasses import dataclass

from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import pit_floor, platform
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Terrain, pose

STAGGER = 0.30
"""By how much the right half of an asymmetrical gap lies further ahead than the left one [m] (inferred)."""
APART = 0.95
"""From the end of one obstacle to the beginning of the next [m] (inferred: 0.9 to 1.0 m)."""
DEPTH = 0.5
"""Of the pit below the gaps [m] (inferred)."""
STEP = 0.06
"""Height of a step [m] (published)."""
_WIDTH, _BEFORE, _BEHIND = 3.0, 1.0, 1.0
"""Of the ground; from the start to the first obstacle; from the last one to the goal [m]."""
_MARGIN = 1.5
"""The ground goes on behind start and goal [m]."""
_scale = takes_difficulty(
    "scale", "widths of the gaps and heights of the steps as parts of the published ones", "1", low=0.2, high=3.0
)


@takes_difficulty("width", "width of the trench", "m", low=0.05, high=1.0)
def gap(*, seed: int = 0, width: float = 0.30) -> Terrain:
    """A trench from side to side, to be stepped over.

    It is ``width`` [m] across and 1 m deep.
    """
    elements = (
        platform("start_platform", -3.5, 0.0, 4.0),
        platform("goal_platform", width, width + 3.5, 4.0),
        pit_floor(-3.5, width + 3.5, 4.0, -1.0),
    )
    return Terrain("gap", (-1.5, 0, 0), (width + 1.5, 0), DEFAULT_FRICTION, elements)


@dataclass(frozen=True)
class _Gap:
    """A trench across the way; or its left and its right half, apart."""

    width: float
    """[m]"""
    stagger: float = 0.0
    """[m]"""

    @property
    def length(self) -> float:
        """Along the way [m]."""
        return self.width + self.stagger


@dataclass(frozen=True)
class _Step:
    """From here on the ground is higher."""

    rise: float
    """[m]; negative: down."""
    length: float = 0.0
    """[m]"""


@_scale
def gaps_symmetric(*, seed: int = 0, scale: float = 1.0, depth: float = DEPTH, apart: float = APART) -> Terrain:
    """Two gaps from side to side, of 10 and 15 cm.

    They are ``apart`` [m] from each other, ``depth`` [m] deep and ``scale`` times as wide.
    """
    return _course("gaps_symmetric", [_Gap(0.10 * scale), _Gap(0.15 * scale)], depth, apart)


@_scale
def gaps_staggered(
    *, seed: int = 0, scale: float = 1.0, depth: float = DEPTH, apart: float = APART, stagger: float = STAGGER
) -> Terrain:
    """Two asymmetrical gaps of 15 cm, then a step of 6 cm up.

    The right half of an asymmetrical gap begins ``stagger`` [m] behind where the left one begins. Obstacles are ``apart``
    [m] from each other, gaps ``depth`` [m] deep; widths and height are ``scale`` times those.
    """
    gap = _Gap(0.15 * scale, stagger)
    return _course("gaps_staggered", [gap, gap, _Step(STEP * scale)], depth, apart)


@_scale
def gaps_and_steps(
    *, seed: int = 0, scale: float = 1.0, depth: float = DEPTH, apart: float = APART, stagger: float = STAGGER
) -> Terrain:
    """A gap of 10 cm, asymmetrical ones of 12 and 13 cm, a step of 6 cm up and one down.

    Otherwise as ``gaps_staggered``.
    """
    gaps = [_Gap(0.10 * scale), _Gap(0.12 * scale, stagger), _Gap(0.13 * scale, stagger)]
    return _course("gaps_and_steps", [*gaps, _Step(STEP * scale), _Step(-STEP * scale)], depth, apart)


def _course(name: str, obstacles: list, depth: float, apart: float) -> Terrain:
    """The obstacles one after the other; the first begins at x = 0, the robot comes from -x."""
    places, x = [], 0.0
    for obstacle in obstacles:
        places.append((x, obstacle))
        x += obstacle.length + apart
    start, goal = -_BEFORE, round(x - apart + _BEHIND, 3)
    is_split = any(isinstance(obstacle, _Gap) and obstacle.stagger > 0.0 for obstacle in obstacles)
    elements = []
    for side in ("left", "right") if is_split else ("",):
        pieces = _pieces(places, start - _MARGIN, goal + _MARGIN, is_right=side == "right")
        for k, (begin, end, top) in enumerate(pieces):
            width = 0.5 * _WIDTH if side else _WIDTH
            y = {"left": 0.25 * _WIDTH, "right": -0.25 * _WIDTH, "": 0.0}[side]
            center = (0.5 * (begin + end), y, 0.5 * (top - depth))
            label = f"ground_{side}_{k}" if side else f"ground_{k}"
            elements.append(Box(name=label, size=(end - begin, width, top + depth), X_WE=pose(center)))
    elements.append(pit_floor(start - _MARGIN, goal + _MARGIN, _WIDTH, -depth))
    return Terrain(name, (start, 0, 0), (goal, 0), DEFAULT_FRICTION, tuple(elements))


def _pieces(places: list, begin: float, end: float, *, is_right: bool) -> list[tuple[float, float, float]]:
    """Where ground of one height begins and ends along x, and how high it is [m]."""
    pieces, top = [], 0.0
    for x, obstacle in places:
        if isinstance(obstacle, _Gap):
            x += obstacle.stagger if is_right else 0.0
            pieces.append((begin, x, top))
            begin = x + obstacle.width
        else:
            pieces.append((begin, x, top))
            begin, top = x, top + obstacle.rise
    return [*pieces, (begin, end, top)]
