"""Foothold search: with which gait, how carefully and towards which waypoint (QuadPiPS section VI-C)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from quadpips_drake.compiling import work_clock
from quadpips_drake.gaits.swing_gaits import SwingGait
from quadpips_drake.planning.experience.edge_experience import EdgeExperience
from quadpips_drake.planning.footholds.escalation import careful, effort_at, escalated, freely
from quadpips_drake.planning.footholds.family_search import FamilySearch
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_problem import FootholdProblem, pose_problem
from quadpips_drake.planning.footholds.found_plan import found_plan
from quadpips_drake.planning.footholds.gait_choice import gait_to_search, need_of_care
from quadpips_drake.planning.footholds.local_path import local_path, prefix_lengths
from quadpips_drake.planning.footholds.search_node import SearchResult
from quadpips_drake.planning.footholds.stance_rules import make_transition_model
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.plans import FootholdPlan, RefusedSwings, TorsoPath
from quadpips_drake.values.robot_state import RobotState

_WORTH_OF_ARRIVAL = 0.2
"""A plan that ends at its waypoint is worth as much as one that leads so much further [m]."""


@dataclass
class _Attempt:
    """What the searches with one gait led to."""

    config: FootholdConfig
    gait: SwingGait
    waypoint: np.ndarray
    search: FamilySearch
    result: SearchResult
    """To make the plan of; its node is -1 when there is none."""
    expansions: int
    time_limit_hit: bool


def _attempt(
    problem: FootholdProblem,
    state,
    torso_path,
    robot,
    config: FootholdConfig,
    deadline: float,
    refused: RefusedSwings,
    clears,
    has_room,
) -> _Attempt:
    """Searches for waypoints ever nearer along the torso path until one is reached."""
    path, waypoint = local_path(state, torso_path, config.local_radius)
    gait, model = gait_to_search(config), make_transition_model(robot, config)
    attempts = []
    for count in prefix_lengths(len(path), config.waypoint_retries):
        test = refused, clears, has_room, problem.experience
        search = FamilySearch(gait, config, model, problem.table, problem.labels, path[:count], deadline, *test)
        result = search.run(problem.feet, problem.normals, problem.regions, problem.hanging)
        result.complete &= count == len(path)
        attempts.append((search, result))
        if not result.reason:
            break
    expansions, late = (sum(getattr(r, key) for _, r in attempts) for key in ("expansions", "time_limit_hit"))
    return _Attempt(config, gait, waypoint, *max(attempts, key=lambda attempt: _worth(*attempt)), expansions, bool(late))


def _worth(search: FamilySearch, result: SearchResult) -> float:
    """How far a search led [m]; one that arrived, if only at a nearer waypoint, ends in a better stance to wait in."""
    if result.node < 0:
        return -np.inf
    node = search.nodes[result.node]
    return search.progress(node) - node.bad_ground + (0.0 if result.reason else _WORTH_OF_ARRIVAL)


def _is_short(attempt: _Attempt) -> bool:
    """Whether the swings should rather come in any order, because the gait leads nowhere."""
    config, result = attempt.config, attempt.result
    asked = bool(result.reason) and config.free_below > 0.0 and not config.any_order
    return asked and (result.node < 0 or attempt.search.progress(attempt.search.nodes[result.node]) < config.free_below)


def _need_of_care(attempt: _Attempt) -> str:
    """Why the plan found should rather be made of single swings; empty when it need not."""
    config = attempt.config
    if config.gait == config.careful_gait:
        return ""
    chain = attempt.search.stances(attempt.result.node)
    feet, rpy = np.array([node.feet for node in chain]), np.array([node.rpy_WB for node in chain])
    return need_of_care(feet, rpy, config)


def search_footholds(
    state: RobotState,
    regions,
    torso_path: TorsoPath,
    robot,
    config: FootholdConfig,
    refused: RefusedSwings | None = None,
    clears: Callable = lambda duration, start, end: True,
    has_room: Callable = lambda p_WB, rpy_WB: True,
    labels: LabelImage | None = None,
    experience: EdgeExperience | None = None,
) -> FootholdPlan:
    """Finds the swings that lead from where the robot stands towards the local waypoint on the torso path.

    A* over contact-mode families as in QuadPiPS section VI-C, its graph built lazily: phases of the gait in turn, footholds
    in the swinging legs' superquadrics (eq. 15), stable stances (eqs. 16-17), bounded swings (eq. 18). The waypoint is the
    last pose of the torso path within ``config.local_radius``. If nothing leads to it, earlier poses are tried; if nothing
    leads there either, the stance with the most progress ends the plan. A plan also ends after ``config.max_steps``.

    Args:
        state: measured state of the robot.
        regions: RegionSet to step on, in W.
        torso_path: result of the torso search; its ``level`` says how hard to try, see ``escalation``.
        refused: RefusedSwings; nothing like them is in the plan.
        clears: (duration [s], start, end) -> whether a foot clears the ground on the way from start to end, each a ground
            point [m] and an upward normal in W, (3,) and (3,). See ``trajectory/swing/swing_clearance.py``.
        has_room: (p_WB, rpy_WB) -> whether nothing is in the way of the torso there. See ``torso/torso_room.py``.
        labels: the newest image, by which footholds cost more if ``config.steppability`` is "penalty"; without one the
            labels of the regions take its place.
        experience: what transitions cost by it; None: nothing.

    Returns:
        A FootholdPlan; without stances and with a reason when there is none.
    """
    started, config = work_clock(), escalated(config, torso_path.level)
    if not torso_path.success:
        reason = torso_path.reason or "there is no torso path"
        return FootholdPlan(state.stamp, torso_path.request_id, reason=reason, complete=False)
    if experience is not None:
        experience = experience.weighed(effort_at(torso_path.level).labels)
    problem = pose_problem(state, regions, robot, config, labels, experience)
    refused = refused or RefusedSwings.empty()
    asked, how = (problem, state, torso_path, robot), (started + config.time_limit, refused, clears, has_room)
    attempt = _attempt(*asked, config, *how)
    expansions = attempt.expansions
    if _is_short(attempt):
        free = _attempt(*asked, freely(config), *how)
        expansions += free.expansions
        attempt = max(attempt, free, key=lambda each: _worth(each.search, each.result))
    need = _need_of_care(attempt)
    if need:
        carefully = _attempt(*asked, careful(attempt.config), *how)
        expansions += carefully.expansions
        attempt = carefully if carefully.result.node >= 0 else attempt
    return found_plan(attempt, need, expansions, problem, state, torso_path, config, started)
