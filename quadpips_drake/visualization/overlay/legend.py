"""Which colour means what: one list for recordings and films."""

from dataclasses import dataclass

from quadpips_drake.values.legs import Leg
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.colors import (
    BASE_REFERENCE_COLOR,
    COMMAND_COLOR,
    GOAL_COLOR,
    LEG_COLORS,
    PUSH_COLOR,
    REGION_COLORS,
    START_COLOR,
    WAYPOINT_COLOR,
)

_CLEARANCES = (
    (REGION_COLORS[Steppability.STEPPABLE], "safe"),
    (REGION_COLORS[Steppability.PASSABLE], "safe, near what is not"),
    (REGION_COLORS[Steppability.NON_PASSABLE], "unsafe"),
)
_LEGS = tuple((LEG_COLORS[leg], leg.name) for leg in Leg)
_LABELS = tuple(
    (REGION_COLORS[label], words)
    for label, words in (
        (Steppability.STEPPABLE, "a foot can stand"),
        (Steppability.PASSABLE, "a foot clears it"),
        (Steppability.NON_PASSABLE, "keep away"),
        (Steppability.UNKNOWN, "not judged"),
    )
)


@dataclass(frozen=True)
class LegendEntry:
    """One layer of a drawing, in words."""

    layer: str
    """Its name in Meshcat, below /quadpips."""
    words: str
    shape: str
    """dot, ring, line or patch: how its colours are shown."""
    colors: tuple = ()
    """(colour, what that means; may be empty) of each; a colour is red, green, blue in [0, 1]."""


LEGEND = (
    LegendEntry("labels", "dots: what the camera sees, by label", "dot", _LABELS),
    LegendEntry("regions", "outlined: planar regions, same colours", "patch"),
    LegendEntry("footholds", "balls: footholds in force, by leg", "dot", _LEGS),
    LegendEntry("swings", "curves: ways of the swinging feet, by leg", "line"),
    LegendEntry("stances", "discs: footholds of the newest plan; ball: its waypoint", "dot", ((WAYPOINT_COLOR, ""),)),
    LegendEntry("costmap", "dots: where a foot may come down", "dot", _CLEARANCES),
    LegendEntry("landed", "small discs: where feet came down, by leg", "dot"),
    LegendEntry("base_reference", "way of the base, as planned", "line", ((BASE_REFERENCE_COLOR, ""),)),
    LegendEntry("course/start", "start", "patch", ((START_COLOR, ""),)),
    LegendEntry("course/goal", "goal", "patch", ((GOAL_COLOR, ""),)),
    LegendEntry("command", "commanded velocity and turn", "line", ((COMMAND_COLOR, ""),)),
    LegendEntry("pushes", "push on the base", "line", ((PUSH_COLOR, ""),)),
)


def as_hex(color) -> str:
    """A colour as #rrggbb."""
    return "#" + "".join(f"{round(255 * min(max(value, 0.0), 1.0)):02x}" for value in color[:3])


def plain_legend(layers) -> list[dict]:
    """The entries of those ``layers`` that are there, as JSON has it."""
    return [
        {
            "layer": entry.layer,
            "words": entry.words,
            "shape": entry.shape,
            "colors": [[as_hex(color), meaning] for color, meaning in entry.colors],
        }
        for entry in LEGEND
        if entry.layer in layers
    ]
