"""Whether thighs and knees clear the ground along a motion.

A robot whose knees point backward, as the Go2's do, steps down from an edge and hits that edge with its knee: the hip comes
down with the foot, while the torso is still behind the edge. Neither the way of the foot nor the stances at its ends say so.
"""

import numpy as np
from numba import njit

from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.robots.kinematic_tree import link_poses_B
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.legs import NUM_LEGS
from quadpips_drake.values.regions import GroundHeights

_STEP = 0.02
"""Between points along a thigh [m]."""
_ASIDE = 0.7
"""Its underside is looked at beside its axis, too: that far [radius], where it is about that far below the axis."""
_EVERY = 3
"""One of so many knots is looked at."""
_POSITION, _ORIENTATION, _JOINTS = CentroidalState.POSITION, CentroidalState.ORIENTATION, CentroidalState.JOINTS


def room_below_thighs(robot: RobotModel, states: np.ndarray, heights: GroundHeights | None) -> np.ndarray:
    """The least room between each leg's thigh, with its knee, and the ground below along a motion [m].

    Args:
        robot: whose.
        states: of the centroidal model, (n, 24).
        heights: of all surfaces.

    Returns:
        (4,), negative where a thigh is in the ground; inf where nothing is known of it.
    """
    least = np.full(NUM_LEGS, np.inf)
    if heights is not None and heights.height.size:
        tree, states = robot.tree, np.ascontiguousarray(states[::-_EVERY])
        axes, offsets = tree.joint_axis, tree.joint_offset
        _room_below(heights.height, heights.corner, heights.cell, states, axes, offsets, robot.leg_shapes, least)
    return least


@njit(cache=True, nogil=True)
def _cell_at(height, corner, cell, x, y):
    """The cell at x, y, counted row by row; -1 where nothing is known."""
    row, column = int(np.floor((x - corner[0]) / cell)), int(np.floor((y - corner[1]) / cell))
    if not (0 <= row < height.shape[0] and 0 <= column < height.shape[1]) or np.isnan(height[row, column]):
        return -1
    return row * height.shape[1] + column


@njit(cache=True, nogil=True)
def _room_below(height, corner, cell, states, axes, offsets, shapes, least):
    """Lowers ``least`` (4,) to the room below each thigh."""
    for state in states:
        R_WB = rotation_from_rpy(state[_ORIENTATION])
        rotations, origins = link_poses_B(axes, offsets, state[_JOINTS])
        for leg in range(4):
            thigh = 3 * leg + 2
            R_WL, p_WL = R_WB @ rotations[thigh], state[_POSITION] + R_WB @ origins[thigh]
            least[leg] = min(least[leg], _room_below_thigh(height, corner, cell, R_WL, p_WL, leg, shapes))


@njit(cache=True, nogil=True)
def _room_below_thigh(height, corner, cell, R_WL, p_WL, leg, shapes):
    """The room of one thigh at its link's pose: over the second highest cell below it, for one alone may be noise."""
    least, second, lowest = np.inf, np.inf, -1
    for k in range(len(shapes.radii[leg])):
        radius = shapes.radii[leg, k]
        if shapes.links[leg, k] != 0 or radius <= 0.0:
            continue
        start, way = p_WL + R_WL @ shapes.ends[leg, k, 0], R_WL @ (shapes.ends[leg, k, 1] - shapes.ends[leg, k, 0])
        pieces = max(int(np.ceil(np.sqrt((way * way).sum()) / _STEP)), 1)
        for i in range(pieces + 1):
            point = start + way * (i / pieces)
            for dx, dy in ((0.0, 0.0), (_ASIDE, 0.0), (-_ASIDE, 0.0), (0.0, _ASIDE), (0.0, -_ASIDE)):
                found = _cell_at(height, corner, cell, point[0] + dx * radius, point[1] + dy * radius)
                if found < 0:
                    continue
                below = radius if dx == dy else _ASIDE * radius
                room = point[2] - below - height[found // height.shape[1], found % height.shape[1]]
                if found == lowest:
                    least = min(least, room)
                elif room < least:
                    least, second, lowest = room, least, found
                elif room < second:
                    second = room
    return second
