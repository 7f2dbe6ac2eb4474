"""The rivals as planners: equal to QuadPiPS in all but what they wish for, heard, overruled; they walk and never break."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

import quadpips_drake as qp
from quadpips_drake.baselines.heuristic_module import HeuristicModule
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.trials.trial import Trial
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.status import PlannerPhase, SafetyStatus
from tests.baselines.hand_made import floor
from tests.compare_logs import differences

RIVALS = ("s_mpc", "em_mpc", "lf_mpc")
STATED = {
    ("stages", "tracking", "mpc", "ocp", "weights", "base_orientation"),
    ("stages", "tracking", "mpc", "ocp", "weights", "angular_velocity"),
    ("planner",),
}
"""Keys in which a rival may differ from QuadPiPS, beside those of its own section, ..."""
MORE = {"s_mpc": set(), "em_mpc": {("stages", "region_source")}, "lf_mpc": set()}
"""... and where its regions come from."""


def leaves(tree, path=()) -> dict:
    """All values by their path of keys."""
    if not isinstance(tree, dict):
        return {path: tree}
    return {key: value for name, item in tree.items() for key, value in leaves(item, (*path, name)).items()}


@pytest.mark.parametrize("robot", ["anymal_c", "go2"])
@pytest.mark.parametrize("rival", RIVALS)
def test_all_but_what_is_stated_is_equal(rival, robot):
    ours, theirs = (
        leaves(asdict(qp.load_config(robot, terrain="parallel_beams", planner=planner))) for planner in ("quadpips", rival)
    )
    different = {key for key in ours if theirs.get(key) != ours[key]}
    more = {key for key in theirs.keys() - ours.keys() if key[:2] != ("stages", "heuristic")}
    assert different == STATED | MORE[rival] and not more
    assert asdict(qp.TrialConfig(planner=rival, robot=robot)) == asdict(qp.load_config(robot, planner=rival)) | {
        "terrain": "stepping_stones"
    }


def test_they_differ_from_each_other_in_how_swings_clear_the_ground():
    first, second = (leaves(asdict(qp.load_config(planner=rival))) for rival in RIVALS[:2])
    different = {key for key in first if second[key] != first[key]}
    assert different == {
        ("planner",),
        ("stages", "region_source"),
        ("stages", "heuristic", "reference", "clear_ground"),
    }


def test_what_is_set_counts_more_than_wishes():
    sets = ("stages.tracking.mpc.ocp.weights.base_orientation=[7,8,9]", "stages.heuristic.reference.clear_ground=false")
    stages = qp.load_config(planner="em_mpc", sets=sets).stages
    assert stages.tracking.mpc.ocp.weights.base_orientation == [7, 8, 9]
    assert stages.tracking.mpc.ocp.weights.angular_velocity == [30, 30, 30]
    assert not stages.heuristic.reference.clear_ground


def test_a_wish_may_be_a_region_source_and_bring_its_section():
    qp.registries.planners.add("wisher", HeuristicModule, wishes={"region_source": "oracle"})
    try:
        assert qp.load_config(planner="wisher").stages.region_source == "oracle"
        assert qp.TrialConfig(planner="wisher").stages.region_source == "oracle"
        assert (
            qp.load_config(planner="wisher", sets=("stages.region_source=superpixels",)).stages.region_source
            == "superpixels"
        )
        qp.registries.planners.add("wisher", HeuristicModule, wishes={"region_sauce": "oracle"})
        with pytest.raises(qp.UserInputError, match="what the planner 'wisher' wants: unknown key 'region_sauce'"):
            qp.load_config(planner="wisher")
    finally:
        qp.registries.planners.remove("wisher")


def module_in(robot, regions, *, goal=(2.0, 0.0), safety=None):
    """A simulator of the module alone, with a robot that stands, and its context."""
    module = HeuristicModule(robot)
    simulator = Simulator(module)
    context = simulator.get_mutable_context()
    values = {"robot_state": standing_state(robot), "region_set": regions, "safety_status": safety or SafetyStatus.empty()}
    for port, value in values.items():
        module.GetInputPort(port).FixValue(context, AbstractValue.Make(value))
    module.GetInputPort("goal").FixValue(context, np.array(goal))
    return module, simulator, context


def advance(module, simulator, context, robot, until):
    """Goes on to a time [s], with a robot that knows the time."""
    for time in np.arange(context.get_time(), until, 0.02):
        state = replace(standing_state(robot), stamp=float(time))
        module.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(state))
        simulator.AdvanceTo(time + 0.02)
    return (module.GetOutputPort(port).Eval(context) for port in ("reference", "status", "plan"))


def test_it_stands_until_there_are_regions_and_while_the_robot_is_unstable():
    robot = load_robot("anymal_c")
    module, simulator, context = module_in(robot, RegionSet.empty())
    reference, status, plan = advance(module, simulator, context, robot, 0.5)
    assert status.phase == PlannerPhase.PAUSING and not reference.footholds and not len(plan.points)
    module.GetInputPort("region_set").FixValue(context, AbstractValue.Make(floor()))
    reference, status, plan = advance(module, simulator, context, robot, 1.5)
    assert status.phase == PlannerPhase.WALKING and len(reference.footholds) > 4 and len(plan.points)
    assert reference.rolling and all(f.region is not None for f in reference.footholds if f.touchdown_time > 0.9)
    module.GetInputPort("safety_status").FixValue(context, AbstractValue.Make(SafetyStatus(1.5, True, "slip", "foot LF")))
    reference, status, _ = advance(module, simulator, context, robot, 1.7)
    assert (status.phase, status.reason) == (PlannerPhase.RECOVERING, "foot LF") and not reference.footholds
    module.GetInputPort("safety_status").FixValue(context, AbstractValue.Make(SafetyStatus(1.7)))
    reference, status, _ = advance(module, simulator, context, robot, 2.5)
    assert status.phase == PlannerPhase.WALKING and reference.footholds


def test_at_the_goal_it_stands():
    robot = load_robot("anymal_c")
    module, simulator, context = module_in(robot, floor(), goal=(0.2, 0.0))
    reference, status, _ = advance(module, simulator, context, robot, 0.5)
    assert status.phase == PlannerPhase.GOAL_REACHED and not status.gave_up and not reference.footholds


def test_without_any_regions_a_trial_ends_with_the_judges_reason():
    trial = Trial(
        qp.load_config(planner="s_mpc", terrain="flat", duration=0.4, sets=("stages.perception.egocan.latency=3",))
    )
    trial.run()
    assert trial.result().reason == "timeout" and not trial.traceback


@pytest.mark.slow
@pytest.mark.parametrize("rival", RIVALS)
def test_same_seed_same_log_to_the_bit_with_a_second_thread_too(rival):
    def log(threads):
        noise = ("stages.perception.depth_noise.sigma=0.002",)
        options = {"terrain": "stepping_stones", "duration": 1.8, "seed": 3, "threads": threads, "latency": "measured"}
        trial = Trial(qp.load_config(planner=rival, sets=noise, **options))
        trial.run()
        return trial.log.arrays()

    alone, beside = log(1), log(2)
    assert not alone["contacts"][-50:].all(), "it is expected to walk by then"
    assert not differences(alone, beside)


@pytest.mark.slow
def test_it_walks_to_a_goal_on_regions_that_are_exact():
    sets = ("stages.region_source=oracle", "stages.heuristic.command.speed=0.4")
    trial = Trial(qp.load_config(planner="s_mpc", terrain="flat", goal=[0.9, 0.3], sets=sets, duration=10.0, seed=3))
    trial.run()
    result = trial.result()
    assert result.success, result.detail
    assert result.footholds["planned"] > 10 and result.footholds["missed"] == 0
    assert result.fallbacks == {"mpc": 0, "wbc": 0} and len(trial.log.arrays()["foothold_leg"]) > 10
