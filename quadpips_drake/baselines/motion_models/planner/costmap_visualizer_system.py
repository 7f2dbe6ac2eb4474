"""CostmapVisualizer: draws where feet may come down, and where they did, into Meshcat."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat
from pydrake.systems.framework import EventStatus

from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmap
from quadpips_drake.framework.ports import declare_input
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.colors import LEG_COLORS, REGION_COLORS
from quadpips_drake.visualization.meshcat_layers import MeshcatLayers
from quadpips_drake.visualization.meshes.plan_meshes import LIFT
from quadpips_drake.visualization.shapes import ColorMesh, ColorPoints

PERIOD = 0.02
"""Between two looks at the feet [s]."""
MAP_PERIOD = 1.0
"""Least time between two drawings of the map [s]; each costs some 100 kB of recording."""
MAP_STRIDE = 3
"""Every how many cells a point is drawn."""
MAP_REACH = 1.3
"""How far from the base the map is drawn along x and y [m]."""
_SHOWN_UNSAFE = 0.3
"""An unsafe cell whose ground is further than this below that of the feet [m] is not drawn: a pit's floor."""
_CLEAR = 0.1
"""So far from unsafe cells a cell is green altogether [m]."""
_MARK = 0.018
"""Radius of the mark where a foot came down [m]."""
_OFF = 0.05
"""A foot that was off the ground for so long has been lifted [s]."""


@dataclass(frozen=True, eq=False)
class _Shown(ImmutableValue):
    """What is on show, and which feet are in the air."""

    maps: int = 0
    map_time: float = -np.inf
    marks: int = 0
    lifted: np.ndarray = field(default_factory=lambda: np.full(4, np.nan))
    """Since when each foot has been off the ground [s]; NaN while it is down."""


class CostmapVisualizer(LeafSystem):
    """Draws the foot costmap as points, green where safe, yellow near unsafe cells, red on them, and a small disc where each
    foot has come down: beside the large ones of the plan.

    .. pydrake_system::

        name: CostmapVisualizer
        input_ports:
        - foot_costmap
        - robot_state
        output_ports: []

    - foot_costmap: FootCostmap, frame W; drawn once a second around the robot.
    - robot_state: RobotState, frame W; its feet leave marks where they come down.
    """

    def __init__(self, robot, meshcat: Meshcat):
        super().__init__()
        self.set_name("costmap_visualizer")
        self._robot, self._layers = robot, MeshcatLayers(meshcat)
        self._costmap = declare_input(self, "foot_costmap", FootCostmap)
        self._state = declare_input(self, "robot_state", RobotState)
        self._shown = self.DeclareAbstractState(AbstractValue.Make(_Shown()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(PERIOD, 0.0, self._look)

    def _look(self, context, state):
        """Draws what is new."""
        time, robot_state = context.get_time(), self._state.Eval(context)
        if not robot_state.is_known:
            return EventStatus.DidNothing()
        shown = self._with_marks(context.get_abstract_state(int(self._shown)).get_value(), robot_state, time)
        if time - shown.map_time >= MAP_PERIOD - 1e-9:
            feet = self._robot.soles_W(self._robot.foot_positions_W(robot_state))
            points = costmap_points(self._costmap.Eval(context), robot_state.p_WB[:2], float(feet[:, 2].mean()))
            self._layers.replace("costmap", shown.maps + 1, points, time)
            shown = _Shown(shown.maps + 1, time, shown.marks, shown.lifted)
        state.get_mutable_abstract_state(int(self._shown)).set_value(shown)
        return EventStatus.Succeeded()

    def _with_marks(self, shown: _Shown, robot_state: RobotState, time: float) -> _Shown:
        """Marks the feet that come down now."""
        lifted, contacts = shown.lifted, robot_state.contacts
        landed = np.flatnonzero(contacts & (time - lifted >= _OFF - 1e-9))
        lifted = np.where(contacts, np.nan, np.where(np.isnan(lifted), time, lifted))
        marks = shown.marks
        if len(landed):
            soles = self._robot.soles_W(self._robot.foot_positions_W(robot_state))
            mesh = ColorMesh()
            for leg in landed:
                mesh.add_disc(soles[leg] + [0.0, 0.0, 3.0 * LIFT], np.array([0.0, 0.0, 1.0]), _MARK, (0.1, 0.1, 0.1))
                mesh.add_disc(
                    soles[leg] + [0.0, 0.0, 3.5 * LIFT], np.array([0.0, 0.0, 1.0]), 0.6 * _MARK, LEG_COLORS[Leg(leg)]
                )
            marks += 1
            self._layers.replace(f"landed/{marks}", 1, mesh, time)
        return _Shown(shown.maps, shown.map_time, marks, lifted)


def costmap_points(costmap: FootCostmap, center: np.ndarray, level: float) -> ColorPoints:
    """A point for every MAP_STRIDE-th known cell around ``center`` (2,) [m], coloured by its distance to unsafe cells.

    ``level``: height of the ground under the feet [m].
    """
    n, m = costmap.height.shape
    i, j = np.arange(0, n, MAP_STRIDE), np.arange(0, m, MAP_STRIDE)
    x, y = costmap.corner[0] + costmap.cell * (i + 0.5), costmap.corner[1] + costmap.cell * (j + 0.5)
    near = np.abs(x - center[0])[:, None] < MAP_REACH
    near = near & (np.abs(y - center[1])[None] < MAP_REACH)
    height, distance = costmap.height[np.ix_(i, j)], costmap.distance[np.ix_(i, j)]
    with np.errstate(invalid="ignore"):
        shown = near & np.isfinite(height) & ((distance > 0.0) | (height > level - _SHOWN_UNSAFE))
    a, b = np.nonzero(shown)
    positions = np.column_stack((x[a], y[b], height[shown] + LIFT))
    return ColorPoints(positions, costmap_colors(distance[shown]), 0.8 * MAP_STRIDE * costmap.cell)


def costmap_colors(distance: np.ndarray) -> np.ndarray:
    """Red, green, blue (..., 3) of cells at ``distance`` (...) [m] from unsafe ones: red on these, yellow beside, green."""
    clear = np.clip(distance / _CLEAR, 0.0, 1.0)[..., None]
    safe, unsafe = (np.array(REGION_COLORS[label]) for label in (Steppability.STEPPABLE, Steppability.NON_PASSABLE))
    warning = np.array(REGION_COLORS[Steppability.PASSABLE])
    return np.where(clear > 0.0, warning + clear * (safe - warning), unsafe)
