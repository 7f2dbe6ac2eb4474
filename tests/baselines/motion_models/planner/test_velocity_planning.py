"""What is commanded when: beginning, walking over gaps, fallbacks, stops, and that nothing is done blindly."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.baselines.motion_models.planner.adaptation import AdaptationConfig
from quadpips_drake.baselines.motion_models.planner.command_search import CommandSearch, CommandSearchConfig, PlanKind
from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmap
from quadpips_drake.baselines.motion_models.planner.velocity_planner_config import VelocityPlannerConfig
from quadpips_drake.baselines.motion_models.planner.velocity_planning import PlanningMemory, VelocityPlanning
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import PlannerPhase, SafetyStatus
from tests.baselines.motion_models.planner.toy_walk import ToyRobot, ToyWalk
from tests.baselines.motion_models.planner.worlds import ground, ideal, sluggish

GOAL = (2.0, 0.0)
GAP = (0.55, 0.70)
"""[m]"""


def walk_with(models=None, config=None, *, blind=False, **walk) -> ToyWalk:
    models, config = models or sluggish(), config or VelocityPlannerConfig()
    search = None if blind else CommandSearch(models, config.search, goal_tolerance=config.goal_tolerance)
    return ToyWalk(VelocityPlanning(ToyRobot(), "trot", config, search), models, **walk)


def kept(world: FootCostmap):
    """The same map, always fresh."""
    return lambda now: replace(world, stamp=now)


def test_it_walks_over_gaps_to_the_goal_and_stands_there():
    gaps = [(0.57, 0.67), (1.43, 1.58)]
    toy = walk_with(y=0.04)
    toy.walk(12.0, GOAL, kept(ground(gaps)), until=lambda memory: memory.phase == PlannerPhase.GOAL_REACHED)
    memory = toy.memory
    assert memory.phase == PlannerPhase.GOAL_REACHED and memory.gait == "stance" and not memory.command.any()
    assert np.hypot(*(toy.step.position - GOAL)) <= 0.1
    footholds = np.array(toy.footholds)
    for begin, end in gaps:
        assert not ((footholds[:, 0] > begin) & (footholds[:, 0] < end)).any()
    assert abs(toy.step.position[1]) < 0.02, "it came back to its line"
    assert memory.plans == len(toy.commands) and not memory.fallbacks
    assert memory.errors.count == len(toy.commands)
    told = memory.errors.plain()
    assert told["steps"] == len(toy.commands)
    assert max(abs(told[name][key]) for name in ("cdm", "fdm", "cvm") for key in ("mae", "mean", "mae_y")) < 1e-6
    assert memory.cost > 0.0 and memory.expansions >= memory.plans
    toy.walk(1.0, GOAL, kept(ground(gaps)))
    assert toy.memory.phase == PlannerPhase.GOAL_REACHED
    toy.step = replace(toy.step, position=toy.step.position - [0.4, 0.0])
    toy.walk(0.5, GOAL, kept(ground(gaps)))
    assert toy.memory.phase == PlannerPhase.WALKING, "somebody moved it away"


def test_errors_of_the_models_are_measured():
    toy = walk_with(error=0.01)
    toy.walk(3.0, GOAL, kept(ground()))
    told = toy.memory.errors.plain()
    assert told["fdm"]["mae"] == pytest.approx(0.01, abs=1e-4) == told["fdm"]["mean"]
    assert told["cdm"]["mae"] < 1e-6


def test_models_that_go_on_learning_err_less_on_another_walk():
    """Feet come down 1 cm further than the models say: known after some steps."""
    toy = walk_with(config=VelocityPlannerConfig(adaptation=AdaptationConfig(enabled=True, doubt=1.0)), error=0.01)
    toy.walk(6.0, (3.0, 0.0), kept(ground()))
    memory = toy.memory
    assert memory.adaptation.steps == memory.errors.count == memory.first_errors.count > 10
    assert memory.first_errors.plain()["fdm"]["mae"] == pytest.approx(0.01, abs=1e-3)
    assert memory.errors.plain()["fdm"]["mae"] < 0.006
    usual = walk_with(error=0.01)
    usual.walk(2.0, (3.0, 0.0), kept(ground()))
    assert usual.memory.adaptation is None and usual.memory.first_errors.count == 0


def test_without_a_map_it_waits_and_then_gives_up():
    for world, reason in ((FootCostmap.empty(), "no map"), (ground([(-1.0, 4.0)]), "safe")):
        toy = walk_with()
        toy.walk(1.0, GOAL, kept(world))
        assert toy.memory.phase == PlannerPhase.PLANNING and toy.memory.gait == "stance"
        toy.walk(2.0, GOAL, kept(world))
        assert toy.memory.phase == PlannerPhase.NO_PLAN and reason in toy.memory.reason
        toy.walk(1.0, GOAL, kept(ground()))
        assert toy.memory.phase == PlannerPhase.NO_PLAN and toy.memory.gait == "stance", "for good"
    toy = walk_with()
    toy.walk(1.0, GOAL, kept(FootCostmap.empty()))
    toy.walk(1.0, GOAL, kept(ground()))
    assert toy.memory.phase == PlannerPhase.WALKING, "the map came in time"


@pytest.mark.parametrize("kind", ["stale", "empty", "nothing safe"])
def test_a_map_that_goes_wrong_on_the_way_ends_the_walk(kind):
    good, late = ground(), 2.0
    bad = {"stale": replace(good, stamp=late - 0.1), "empty": FootCostmap.empty(), "nothing safe": ground([(-1.0, 4.0)])}[
        kind
    ]
    toy = walk_with()
    toy.walk(4.0, GOAL, lambda now: replace(good, stamp=now) if now < late else bad)
    assert toy.memory.phase == PlannerPhase.NO_PLAN and toy.memory.gait == "stance" and not toy.memory.command.any()
    assert {"stale": "s old", "empty": "no map", "nothing safe": "no ground"}[kind] in toy.memory.reason


def test_fallbacks_come_in_their_order_and_are_counted():
    """A trench nobody can cross appears ahead of a robot that is under way."""
    config = VelocityPlannerConfig(search=CommandSearchConfig(horizon=3, min_speed=0.2), max_failures=50)
    toy, seen = walk_with(ideal(), config), []
    toy.walk(1.6, GOAL, kept(ground()))
    assert toy.memory.plan.kind == PlanKind.FULL
    trench = round(float(toy.step.position[0]) + 0.74, 2)
    toy.walk(
        4.0,
        GOAL,
        kept(ground([(trench, 4.0)])),
        until=lambda memory: (
            seen.append((memory.plan.kind, memory.plan.reason != "")) or bool(dict(memory.fallbacks).get("stopped"))
        ),
    )
    order = [kind for k, (kind, failed) in enumerate(seen) if failed and seen[k - 1] != (kind, failed)]
    assert order[0] == PlanKind.FULL, "the rest of the last plan"
    assert order[-1] == PlanKind.STOP
    counts = dict(toy.memory.fallbacks)
    assert 1 <= counts["rest_of_last_plan"] <= 2 and counts["stopped"] == 1
    assert toy.memory.phase == PlannerPhase.PAUSING and toy.memory.gait == "stance"
    toy.walk(3.0, GOAL, kept(ground()))
    assert toy.memory.phase in (PlannerPhase.WALKING, PlannerPhase.GOAL_REACHED), "the trench is gone"


def test_the_rest_of_a_plan_that_has_become_unsafe_is_not_walked():
    """Where the next footholds of the plan were, there is a trench now."""
    config = VelocityPlannerConfig(search=CommandSearchConfig(horizon=3, min_speed=0.2), max_failures=50)
    toy = walk_with(ideal(), config)
    toy.walk(1.6, GOAL, kept(ground()))
    plan, used = toy.memory.plan, toy.memory.used
    trench = round(float(plan.feet[used + 1, :, 0].max()) + 0.03, 2)
    toy.walk(1.0, GOAL, kept(ground([(trench, 4.0)])), until=lambda memory: bool(memory.fallbacks))
    assert dict(toy.memory.fallbacks) == {"largest_clearance": 1}
    assert toy.memory.plan.kind == PlanKind.CLEAREST and toy.memory.plan.clearance > 0.0


def test_past_the_goal_and_aside_of_it_the_robot_stops():
    toy = walk_with(y=0.15)
    toy.walk(12.0, GOAL, kept(ground()), until=lambda memory: memory.distance < 0.5)
    toy.step = replace(toy.step, position=np.array([GOAL[0] + 0.02, 0.15]))
    toy.walk(1.0, GOAL, kept(ground()))
    assert toy.memory.phase == PlannerPhase.GOAL_REACHED and toy.memory.distance < 0.25


def test_a_robot_that_treads_on_the_spot_looks_further_ahead():
    """Out of standing three steps do not lead over the gap: each plan stands first."""
    short, world = CommandSearchConfig(horizon=3), kept(ground([GAP]))
    toy = walk_with(config=VelocityPlannerConfig(search=short, patience=1000, max_idle=1000))
    toy.walk(20.0, GOAL, world)
    assert toy.memory.phase == PlannerPhase.WALKING and toy.step.position[0] < GAP[0] and not toy.memory.fallbacks
    toy = walk_with(config=VelocityPlannerConfig(search=short))
    toy.walk(30.0, GOAL, world, until=lambda memory: memory.phase == PlannerPhase.GOAL_REACHED)
    assert toy.memory.phase == PlannerPhase.GOAL_REACHED and dict(toy.memory.fallbacks) == {"stuck": 1}
    footholds = np.array(toy.footholds)
    assert not ((footholds[:, 0] > GAP[0]) & (footholds[:, 0] < GAP[1])).any()


def test_where_that_does_not_help_either_it_gives_up():
    toy = walk_with()
    toy.walk(40.0, GOAL, kept(ground([(0.6, 1.0)])), until=lambda memory: memory.gave_up)
    assert toy.memory.gave_up and toy.memory.reason == "61 plans have brought it less than 0.25 m nearer to the goal"
    assert toy.memory.gait == "stance" and not toy.memory.command.any()


def test_the_clearest_step_is_taken_where_nothing_is_left_of_a_plan():
    config = VelocityPlannerConfig(search=CommandSearchConfig(horizon=7, min_speed=0.1))
    toy = walk_with(ideal(), config)
    toy.walk(0.7, GOAL, kept(ground([(0.5, 4.0)])), until=lambda memory: bool(memory.fallbacks))
    assert dict(toy.memory.fallbacks) == {"largest_clearance": 1}
    assert toy.memory.plan.kind == PlanKind.CLEAREST and toy.memory.plan.clearance > 0.0
    assert toy.memory.command[0] == pytest.approx(0.1)


def test_it_gives_up_after_failures_in_a_row():
    config = VelocityPlannerConfig(search=CommandSearchConfig(horizon=7, min_speed=0.1), max_failures=2)
    toy = walk_with(ideal(), config)
    toy.walk(9.0, GOAL, kept(ground([(0.75, 4.0)])))
    assert toy.memory.phase == PlannerPhase.NO_PLAN
    assert toy.memory.reason.startswith("3 searches in a row")


def test_an_unstable_robot_drops_its_plan_and_begins_anew():
    toy, world = walk_with(), kept(ground())
    toy.walk(1.5, GOAL, world)
    assert toy.memory.plan.found
    toy.walk(0.5, GOAL, world, safety=SafetyStatus(1.5, unstable=True, reason="a push"))
    assert toy.memory.phase == PlannerPhase.RECOVERING and "a push" in toy.memory.reason
    assert toy.memory.gait == "stance" and not toy.memory.plan.found and toy.memory.broken_off == 1
    before = toy.memory.errors.count
    toy.walk(1.5, GOAL, world)
    assert toy.memory.phase == PlannerPhase.WALKING and toy.memory.plan.found
    assert toy.memory.errors.count > before


def test_the_blind_variant_looks_at_nothing():
    def nobody(now):
        raise AssertionError("it looked")

    toy = walk_with(blind=True, y=0.1)
    toy.walk(2.0, GOAL, nobody)
    assert toy.memory.plan.kind == PlanKind.BLIND and toy.memory.plans == 0
    assert toy.memory.command[0] == 0.4 and toy.memory.command[1] < 0.0
    assert toy.memory.errors.plain() == {"steps": 0}


def test_before_the_first_estimate_nothing_happens():
    planning = VelocityPlanning(ToyRobot(), "trot", VelocityPlannerConfig(), None)
    memory = PlanningMemory()
    assert planning.update(memory, RobotState.empty(), np.zeros(2), SafetyStatus.empty(), None) is memory
