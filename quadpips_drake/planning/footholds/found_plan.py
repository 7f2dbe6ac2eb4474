"""What the foothold search hands on."""

from quadpips_drake.compiling import work_clock
from quadpips_drake.planning.footholds.foothold_problem import FootholdProblem
from quadpips_drake.planning.footholds.stance_rules import REJECTIONS
from quadpips_drake.values.plans import FootholdPlan, Stance


def found_plan(
    attempt, need: str, expansions: int, problem: FootholdProblem, state, torso_path, config, started
) -> FootholdPlan:
    """The plan that an attempt found.

    Args:
        attempt: the searches with one gait, of ``foothold_search``.
        need: why the gait should be the careful one; empty if there is no reason.
        expansions: of all attempts.
        problem, state, torso_path, config: what was asked for.
        started: when [s].
    """
    search, result = attempt.search, attempt.result
    chain, gait = search.stances(result.node), attempt.gait
    return FootholdPlan(
        stamp=state.stamp,
        request_id=torso_path.request_id,
        stances=tuple(
            Stance(node.feet, node.normals, tuple(problem.usable[k] for k in node.regions), node.p_WB, node.rpy_WB)
            for node in chain
        ),
        swing_legs=tuple(search.swing_legs(node) for node in chain[1:]),
        gait=gait.name,
        swing_duration=gait.swing_duration,
        stance_duration=gait.stance_duration,
        gait_reason=need if attempt.gait.name != config.gait else "",
        waypoint=attempt.waypoint,
        reason="" if chain else result.reason,
        expansions=expansions,
        elapsed=work_clock() - started,
        complete=result.complete,
        time_limit_hit=attempt.time_limit_hit,
        cost=chain[-1].cost if chain else 0.0,
        considered=result.combinations,
        refusals={why: int(count) for why, count in zip(REJECTIONS, result.refused, strict=True) if count},
    )
