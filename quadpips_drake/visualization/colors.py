"""The colours that legs, labels and curves have in every picture, as red, green, blue in [0, 1]."""

from quadpips_drake.values.legs import Leg
from quadpips_drake.values.steppability import Steppability

LEG_COLORS = {
    Leg.LF: (0.12, 0.47, 0.71),
    Leg.RF: (0.95, 0.50, 0.05),
    Leg.LH: (0.17, 0.63, 0.17),
    Leg.RH: (0.75, 0.15, 0.55),
}
REGION_COLORS = {
    Steppability.UNKNOWN: (0.10, 0.62, 0.66),
    Steppability.STEPPABLE: (0.20, 0.66, 0.33),
    Steppability.PASSABLE: (0.93, 0.69, 0.13),
    Steppability.NON_PASSABLE: (0.80, 0.22, 0.20),
}
BASE_REFERENCE_COLOR = (0.85, 0.10, 0.15)
WAYPOINT_COLOR = (0.95, 0.85, 0.10)
START_COLOR = (0.12, 0.37, 0.75)
GOAL_COLOR = (0.76, 0.09, 0.36)
COMMAND_COLOR = (0.00, 0.45, 0.85)
PUSH_COLOR = (0.95, 0.25, 0.05)
