"""Where to go when no path leads to the goal: to a pose that is nearer to it or shows unseen ground, at little cost."""

from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.values.immutable import ImmutableValue

_MOST = 200
"""Viewpoints that are remembered."""
_SAME_PLACE, _SAME_YAW = 0.15, 0.20
"""Viewpoints nearer to each other than this [m], [rad] count as one."""
_BESIDE_GROUND = 0.35
"""An unseen place counts when there is known ground within this distance [m]: what lies further off cannot be walked on."""
_FULL = 0.33
"""A view is as new as can be when so large a share of it is unseen [-]."""
_LEAST_WAY, _LEAST_TURN = 0.20, 0.50
"""A sub-goal is further away than this [m] or turned by more [rad]."""
_AT_START = 0.25
"""A robot that was nowhere further away than this has not set out yet [m]."""
_TRIALS, _RETRIAL = 3, 0.3
"""A pose is a sub-goal at most so often, and each time before makes it worse by so much [m] ..."""
_IN_VAIN = 1.0
"""... by so much more if no footholds led there from where the robot still stands [m]."""
# Places in a view: fractions of its range, and of its half angle.
_GLANCES = np.array([[r, b] for r in (0.35, 0.6, 0.85) for b in (-0.7, 0.0, 0.7)])
_KNOWN = 0.08
"""Known ground is there within this distance [m], if the robot only wants to see more."""


@dataclass(frozen=True, eq=False)
class Exploration(ImmutableValue):
    """What was tried on the way to one goal; frame W."""

    goal: np.ndarray = field(default_factory=lambda: np.full(2, np.nan))
    """xy [m], (2,)."""
    viewpoints: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """x, y, yaw of the base where plans were made, (n, 3)."""
    detour: int = 0
    """Plans in a row since the robot was nearest to the goal."""
    tried: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Sub-goals that were chosen, x, y, yaw, (k, 3)."""
    avoided: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    """xy along torso paths for which no footholds were found since the robot last walked, (n, 2)."""
    in_vain: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Their ends, x, y, yaw, (j, 3)."""

    def after(self, path) -> "Exploration":
        """Returns it with the end of a TorsoPath among the sub-goals, if it is one."""
        if not path.success or path.to_goal:
            return self
        return replace(self, tried=np.vstack([self.tried, path.poses[-1, [0, 1, 3]]])[-_MOST:])

    def standing_at(self, pose, goal, failed_path=None) -> "Exploration":
        """Returns it with the robot's ``pose`` (x, y, yaw); another goal begins anew.

        ``failed_path``: poses (n, 4) of the last path if it led to no footholds, None if the robot has walked since.
        """
        pose, goal = np.asarray(pose, dtype=float), np.array(goal, dtype=float)
        if not np.hypot(*(goal - self.goal)) < 0.3:  # also when there was none
            return Exploration(goal, pose[None])
        nearest = np.hypot(*(self.viewpoints[:, :2] - goal).T).min()
        detour = 0 if np.hypot(*(pose[:2] - goal)) < nearest else self.detour + 1
        near = np.hypot(*(self.viewpoints[:, :2] - pose[:2]).T) < _SAME_PLACE
        same = near & (np.abs(wrap_angle(self.viewpoints[:, 2] - pose[2])) < _SAME_YAW)
        viewpoints = self.viewpoints if same.any() else np.vstack([self.viewpoints, pose])[-_MOST:]
        avoided, in_vain = np.zeros((0, 2)), np.zeros((0, 3))
        if failed_path is not None and len(failed_path):
            beyond = np.hypot(*(failed_path[:, :2] - pose[:2]).T) > 0.25
            avoided = np.vstack([self.avoided, failed_path[beyond, :2]])
            in_vain = np.vstack([self.in_vain, failed_path[-1, [0, 1, 3]]])
        return Exploration(self.goal, viewpoints, detour, self.tried, avoided, in_vain)


@njit(cache=True)
def _novelty(pose, viewpoints, glances, distance, origin, resolution, view_range, half_angle, view_near, known):
    """Returns the share of the view from ``pose`` that lies beside known ground and was not seen from any viewpoint.

    Ground nearer than ``view_near`` [m] is in no view; places within ``known`` [m] of known ground do not count.
    """
    rows, columns = distance.shape
    unseen = 0
    for g in range(len(glances)):
        bearing = pose[2] + glances[g, 1] * half_angle
        x = pose[0] + glances[g, 0] * view_range * np.cos(bearing)
        y = pose[1] + glances[g, 0] * view_range * np.sin(bearing)
        ix, iy = int(np.rint((x - origin[0]) / resolution)), int(np.rint((y - origin[1]) / resolution))
        if ix < 0 or iy < 0 or ix >= columns or iy >= rows or distance[iy, ix] > _BESIDE_GROUND:
            continue
        if distance[iy, ix] < known:
            continue
        seen = False
        for v in range(len(viewpoints)):
            dx, dy = x - viewpoints[v, 0], y - viewpoints[v, 1]
            away = np.hypot(dx, dy)
            ahead = dx * np.cos(viewpoints[v, 2]) + dy * np.sin(viewpoints[v, 2])
            if away < view_range and ahead > away * np.cos(half_angle) and ahead >= view_near:
                seen = True
                break
        if not seen:
            unseen += 1
    return min(1.0, unseen / (len(glances) * _FULL))


@njit(cache=True, nogil=True)
def _best(order, scores, nearer, poses, viewpoints, glances, distance, origin, resolution, view, min_novelty, weight):
    """Returns the index of the best pose, -1 when none is good. ``order`` sorts ``scores`` ascending."""
    best, best_score = -1, np.inf
    for i in range(len(order)):
        k = order[i]
        if scores[k] >= best_score:
            break
        if nearer[k]:  # on the way: no reason to look round
            return k
        novelty = _novelty(poses[k], viewpoints, glances, distance, origin, resolution, view[0], view[1], view[2], view[3])
        score = scores[k] + weight * (1.0 - novelty)
        if novelty >= min_novelty and score < best_score:
            best, best_score = k, score
    return best


def _times_tried(poses, tried) -> np.ndarray:
    """Returns how often each of ``poses`` (n, 3) was in ``tried`` (k, 3), (n,)."""
    times = np.zeros(len(poses))
    for x, y, yaw in tried:
        near = np.hypot(poses[:, 0] - x, poses[:, 1] - y) < _SAME_PLACE
        times += near & (np.abs(wrap_angle(poses[:, 2] - yaw)) < 2.0 * _SAME_YAW)
    return times


def look_at_goal(lattice, yaw, closed, goal_xy, exploration: Exploration, support, config) -> int:
    """Returns the pose to turn to on the spot, towards the goal; -1 if there is no need.

    Before a robot leaves the place where it was given the goal it looks where it goes: a camera in front sees nothing of
    what lies beside and behind, and once the robot stands at the edge of what is known, that is too near to be seen. There
    is no need if the robot faces the goal within ``view_half_angle``, or if little of the view is new (``min_novelty``).
    Arguments and result as those of ``choose_subgoal``.
    """
    here = lattice.positions[0, :2]
    to_goal = np.asarray(goal_xy) - here
    bearing = np.arctan2(to_goal[1], to_goal[0])
    if np.hypot(*(exploration.viewpoints[:, :2] - here).T).max(initial=0.0) > _AT_START:
        return -1
    if abs(wrap_angle(bearing - yaw)) < config.view_half_angle:
        return -1
    best = int(np.argmin(np.abs(wrap_angle(lattice.yaws - bearing))))
    pose = np.array([*here, lattice.yaws[best]])
    if not closed[best] or _times_tried(pose[None], exploration.tried)[0] >= _TRIALS:
        return -1
    return best if _views(pose, exploration, support, config) >= config.min_novelty else -1


def _views(pose, exploration: Exploration, support, config) -> float:
    """Returns ``_novelty`` of one pose."""
    return _novelty(
        pose, exploration.viewpoints, _GLANCES, support.distance, support.origin, support.resolution,
        config.view_range, config.view_half_angle, 0.0, 0.0,
    )  # fmt: skip


def choose_subgoal(
    lattice, yaw, cost, closed, goal_xy, exploration: Exploration, support, config, *, to_see: bool = False
) -> int:
    """Returns the pose (position * m + yaw index) to go to instead of the goal; -1 if there is nothing left to try.

    Before the robot sets out, the view towards the goal (``look_at_goal``). Else, among the poses in reach, that with the
    least ``way_weight`` times the cost of the way, plus its distance from the goal, plus the turn towards it (weighted). It
    must be nearer to the goal than any viewpoint so far by ``min_progress``, or its view must be new by ``min_novelty``;
    then what it lacks in new places costs ``novelty_weight`` times as much.

    Args:
        yaw: the robot's.
        cost, closed: of each pose, (n m,): of the way from the robot to it, and whether it is in reach.
        to_see: whether only a view of the way to the goal counts, from no nearer than now, that shows what is not known and
            was in none before, ``view_near`` [m] ahead and further.
    """
    first = -1 if to_see else look_at_goal(lattice, yaw, closed, goal_xy, exploration, support, config)
    if first >= 0:
        return first
    m = len(lattice.yaws)
    moved = np.hypot(*(lattice.positions[:, :2] - lattice.positions[0, :2]).T) > _LEAST_WAY
    turned = np.abs(wrap_angle(lattice.yaws - yaw)) > _LEAST_TURN
    reach = np.flatnonzero(closed & (moved[:, None] | turned).ravel())
    poses = np.column_stack([lattice.positions[reach // m, :2], lattice.yaws[reach % m]])
    to_goal = np.asarray(goal_xy) - poses[:, :2]
    rest = np.hypot(*to_goal.T)
    turn = np.where(rest > 0.3, np.abs(wrap_angle(np.arctan2(to_goal[:, 1], to_goal[:, 0]) - poses[:, 2])), 0.0)
    scores = config.way_weight * cost[reach] + rest + config.yaw_weight * turn
    so_far = np.hypot(*(exploration.viewpoints[:, :2] - goal_xy).T).min(
        initial=np.hypot(*(lattice.positions[0, :2] - goal_xy))
    )
    nearer = rest <= so_far - config.min_progress
    glances, view = _GLANCES, [config.view_range, config.view_half_angle, 0.0, 0.0]
    if to_see:
        own = np.hypot(*(lattice.positions[0, :2] - goal_xy))
        back = (rest > own - config.min_progress) & (turn < config.view_half_angle)
        scores, nearer = np.where(back, scores - rest, np.inf), np.zeros(len(reach), dtype=bool)
        part = config.view_near / config.view_range
        glances = np.column_stack([part + (1.0 - part) * (_GLANCES[:, 0] - 0.25), _GLANCES[:, 1]])
        view[2:] = config.view_near, _KNOWN
    if exploration.detour >= config.max_detour:
        return -1
    times = _times_tried(poses, exploration.tried)
    scores += np.where(times < _TRIALS, _RETRIAL * times, np.inf)
    scores += _IN_VAIN * _times_tried(poses, exploration.in_vain)
    best = _best(
        np.argsort(scores, kind="stable"), scores, nearer, np.ascontiguousarray(poses), exploration.viewpoints, glances,
        support.distance, support.origin, support.resolution, np.array(view),
        1.0 if to_see else config.min_novelty, config.novelty_weight,
    )  # fmt: skip
    return int(reach[best]) if best >= 0 else -1
