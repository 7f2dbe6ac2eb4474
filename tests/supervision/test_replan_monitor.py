"""The monitor's state machine, event by event."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.supervision.ground_events import Problem
from quadpips_drake.supervision.replan_monitor import BETTER_VIEW, Monitor, MonitorConfig, Situation, advance
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.plans import FootholdPlan, PlanRequest, RefusedSwing, RefusedSwings, Stance
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import GroundHeights
from quadpips_drake.values.status import SafetyStatus, StageStatus
from tests.planning import worlds
from tests.supervision.walked_references import trot

ROBOT = load_robot("anymal_c")
CONFIG = MonitorConfig(replaced_swings=1)
GOAL = np.array([2.0, 0.0])
REST = worlds.standing_state(ROBOT)
STANCE = Stance(np.zeros((4, 3)), np.zeros((4, 3)), (), np.zeros(3), np.zeros(3))


def no_reference():
    nothing = np.zeros((0, 24))
    return WholeBodyReference(0.0, 0, np.zeros(0), nothing, nothing, ContactSchedule.standing())


def reference(request_id, end_time, x):
    states = np.zeros((2, 24))
    states[-1, CentroidalState.POSITION] = [x, 0.0, ROBOT.nominal_base_height]
    times = np.array([end_time - 1.0, end_time])
    return WholeBodyReference(0.0, request_id, times, states, np.zeros((2, 24)), ContactSchedule.standing())


class Story:
    """Tells the monitor what happens, ten times a second."""

    def __init__(self, config=CONFIG):
        self.config = config
        self.monitor = Monitor(PlanRequest(0, 0.0, GOAL))
        self.now = Situation(0.0, REST, no_reference(), FootholdPlan(0.0, 0), StageStatus(0.0, 0, True), GOAL)

    def goes_on(self, seconds, **changes):
        self.now = replace(self.now, **changes)
        for _ in range(round(10 * seconds)):
            self.monitor = advance(self.monitor, self.now, self.config)
            self.now = replace(self.now, time=self.now.time + 0.1)
        return self.monitor

    def until_planning(self):
        for _ in range(60):
            if self.goes_on(0.1).phase == "planning":
                return self.monitor.request.id
        raise AssertionError(f"still {self.monitor.phase}: {self.monitor.reason}")

    def until_walking(self, x=1.0):
        request_id = self.until_planning()
        return self.goes_on(0.1, reference=reference(request_id, self.now.time + 2.0, x))


def moving(**changes):
    return replace(REST, **changes)


def test_waits_until_the_robot_stands():
    story = Story()
    shaking = SafetyStatus(0.0, at_rest=False)
    assert story.goes_on(2.0, safety=shaking).phase == "standing_up"
    assert story.goes_on(0.2, safety=SafetyStatus(0.0)).phase in ("pausing", "planning")
    restless = Story()
    assert restless.goes_on(4.3, safety=shaking).phase in ("pausing", "planning")


def test_replans_after_a_completed_reference():
    story = Story(replace(CONFIG, lead_time=0.0))
    assert story.until_walking().phase == "walking"
    assert story.goes_on(1.5, state=moving(p_WB=np.array([0.5, 0.0, 0.58]))).phase == "walking"
    story.goes_on(1.0, state=moving(p_WB=np.array([0.95, 0.0, 0.58])))
    assert story.monitor.phase == "planning" and story.monitor.request.id == 2 and story.monitor.replans == 1


def test_replans_when_the_reference_ended_elsewhere():
    story = Story()
    story.until_walking()
    assert story.goes_on(2.5).phase == "walking"
    story.goes_on(0.8)
    assert story.monitor.phase in ("pausing", "planning") and "away" in story.monitor.reason


def test_reaches_the_goal_and_sets_out_again_when_pushed_away():
    story = Story()
    story.until_walking(x=1.9)
    assert story.goes_on(3.0, state=moving(p_WB=np.array([1.9, 0.05, 0.58]))).phase == "goal_reached"
    assert story.goes_on(1.0, state=moving(p_WB=np.array([1.75, 0.05, 0.58]))).phase == "goal_reached"
    assert story.goes_on(1.0, state=moving(p_WB=np.array([1.5, 0.0, 0.58]))).phase == "planning"


@pytest.mark.parametrize("stage", ["footholds", "trajectory", "silence"])
def test_gives_up_after_so_many_failures(stage):
    story = Story(MonitorConfig(max_failed_plans=3))
    for k in range(3):
        request_id = story.until_planning()
        assert request_id == k + 1
        if stage == "footholds":
            story.goes_on(0.1, foothold_plan=FootholdPlan(0.0, request_id, reason="no stones"))
        elif stage == "trajectory":
            story.goes_on(0.2, trajectory_status=StageStatus(0.0, request_id, False, "no solution"))
        else:
            story.goes_on(3.2)
    assert story.monitor.phase == "no_plan" and story.monitor.failed_plans == 3
    words = {"footholds": "no stones", "trajectory": "no solution", "silence": "no reference came"}
    assert words[stage] in story.monitor.reason
    assert story.goes_on(5.0).phase == "no_plan"


def test_a_reference_that_is_shorter_than_the_plan_is_followed():
    story = Story()
    request_id = story.until_planning()
    story.goes_on(0.1, trajectory_status=StageStatus(0.0, request_id, False, "swing 3: out of reach"))
    assert story.monitor.phase == "planning"
    assert story.goes_on(0.1, reference=reference(request_id, 5.0, 1.0)).phase == "walking"


def refusal(request_id, x=0.0):
    start = np.tile([x, 0.0, 0.0], (4, 1))
    return RefusedSwings(request_id, (RefusedSwing((0,), start, start, "swing 1 (LF): no"),))


def test_a_plan_without_a_first_swing_is_asked_for_again_at_once_without_that_swing():
    story = Story(replace(CONFIG, max_refusals=2))
    for number in (1, 2, 3):
        request_id = story.until_planning()
        before = story.now.time
        failed = StageStatus(0.0, request_id, False, "swing 1 (LF): no")
        while story.goes_on(0.1, trajectory_status=failed, refused=refusal(request_id)).phase == "planning":
            assert story.now.time - before < 0.5
        assert len(story.monitor.refused.swings) == number
        assert story.monitor.failed_plans == (number == 3)  # two refusals are no failure yet
        assert story.monitor.wait == (CONFIG.retry_pause if number == 3 else 0.0)


def test_refused_swings_are_forgotten_when_the_robot_has_moved_on():
    story = Story()
    request_id = story.until_planning()
    story.goes_on(0.1, reference=reference(request_id, story.now.time + 2.0, 1.0), refused=refusal(request_id))
    assert story.monitor.phase == "walking" and len(story.monitor.refused.swings) == 1
    story.goes_on(2.5, state=moving(p_WB=np.array([0.95, 0.0, 0.58])))
    assert len(story.monitor.refused.swings) == 1
    story = Story()
    story.until_planning()
    story.goes_on(0.1, refused=refusal(story.monitor.request.id, x=-3.0), foothold_plan=FootholdPlan(0.0, 1, reason="no"))
    story.until_planning()
    assert story.monitor.refused.swings == ()


def test_a_success_forgets_the_failures():
    story = Story(MonitorConfig(max_failed_plans=2))
    story.goes_on(0.1, foothold_plan=FootholdPlan(0.0, story.until_planning(), reason="no stones"))
    request_id = story.until_planning()
    found = FootholdPlan(0.0, request_id, stances=(STANCE, STANCE), swing_legs=((1, 2),))
    story.goes_on(0.1, foothold_plan=found)
    assert story.monitor.phase == "planning"
    story.goes_on(0.1, reference=reference(request_id, story.now.time + 1.0, 0.0))
    assert story.monitor.phase == "walking" and story.monitor.failed_in_a_row == 0 and story.monitor.failed_plans == 1


def test_each_failure_makes_the_next_request_try_harder_and_a_success_less():
    story, levels = Story(), []
    for _ in range(3):
        request_id = story.until_planning()
        levels.append(story.monitor.request.level)
        story.goes_on(0.1, foothold_plan=FootholdPlan(0.0, request_id, reason="no stones"))
    request_id = story.until_planning()
    assert [*levels, story.monitor.request.level] == [0, 1, 2, 3] and story.monitor.escalated == 3
    story.goes_on(0.1, reference=reference(request_id, story.now.time + 1.0, 0.0))
    assert story.monitor.phase == "walking" and story.monitor.level == 2


def test_an_instability_makes_it_careful():
    story = Story()
    story.until_walking()
    story.goes_on(0.1, safety=SafetyStatus(0.0, True, "slip", "a foot slides"))
    story.goes_on(0.3, safety=SafetyStatus(0.0), reference=no_reference())
    assert story.monitor.phase == "planning" and story.monitor.request.level == 1


def test_aborts_recovers_and_replans():
    story = Story()
    story.until_walking()
    story.goes_on(0.5, safety=SafetyStatus(0.0, True, "attitude", "the base tilts by 0.5 rad"))
    assert story.monitor.phase == "recovering" and "tilts" in story.monitor.reason and story.monitor.aborts == 1
    assert story.goes_on(3.0).phase == "recovering"  # as long as the safety monitor says so
    story.goes_on(0.2, safety=SafetyStatus(0.0), reference=no_reference())
    assert story.monitor.phase == "planning" and story.monitor.request.id == 2


def test_bad_settings_are_refused():
    with pytest.raises(UserInputError, match="goal_tolerance"):
        MonitorConfig(goal_tolerance=0.5)
    with pytest.raises(UserInputError, match="pause"):
        MonitorConfig(pause=-1.0)


def walking_ahead(x=1.0):
    """A story in which the robot walks eight swings, 4 s long, and the next plan has just been asked for."""
    story = Story()
    first = story.until_planning()
    begin = story.now.time
    story.goes_on(0.1, reference=trot(first, begin, 8, x))
    while story.monitor.request.id == first and story.now.time < begin + 4.0:
        story.goes_on(0.1)
    return story, first, begin


def test_the_next_plan_is_asked_for_while_walking_from_where_the_robot_will_be():
    story, first, begin = walking_ahead()
    request = story.monitor.request
    assert (request.id, story.monitor.phase) == (first + 1, "walking")
    assert request.start.follows == first
    assert request.start.time == pytest.approx(begin + 3.5), "before the last swing"
    assert request.start.state[CentroidalState.POSITION][0] == pytest.approx(3.5 / 4.0)
    assert request.start.time - 0.1 - CONFIG.lead_time < request.stamp < request.start.time - CONFIG.lead_time + 0.11
    joined = trot(request.id, request.start.time, 8, 1.7)
    assert story.goes_on(0.1, reference=joined).followed == request.id
    assert story.goes_on(2.5).request.id == request.id, "in the middle of the next plan nothing is asked for"
    assert story.goes_on(1.1).request.id == request.id + 1
    assert story.monitor.phase == "walking"


def test_a_next_plan_that_fails_lets_the_robot_walk_to_the_end_and_stand():
    story, _, begin = walking_ahead()
    asked = story.monitor.request.id
    monitor = story.goes_on(0.1, foothold_plan=FootholdPlan(0.0, asked, reason="a gap"))
    assert (monitor.phase, monitor.failed_plans, monitor.failed_in_a_row) == ("walking", 1, 0)
    assert "a gap" in monitor.reason
    assert story.goes_on(begin + 3.8 - story.now.time).request.id == asked, "it is not asked again and again"
    end = moving(p_WB=np.array([1.0, 0.0, 0.58]))
    story.goes_on(0.5, state=end)
    assert story.until_planning() == asked + 1
    assert story.monitor.request.start is None


def test_a_next_plan_that_is_late_is_asked_for_earlier_the_next_time():
    story, _, _ = walking_ahead()
    start = story.monitor.request.start.time
    monitor = story.goes_on(start + 0.2 - story.now.time)
    assert (monitor.phase, monitor.late_plans, monitor.failed_plans) == ("walking", 1, 0)
    assert monitor.lead > 0.1


def test_a_next_plan_that_fails_is_asked_for_again_when_more_has_been_seen():
    """Before the last swing instead of the last but one; not without newer regions."""
    story, begin = Story(replace(CONFIG, replaced_swings=2)), 0.0
    first = story.until_planning()
    begin = story.now.time
    story.goes_on(0.1, reference=trot(first, begin, 8, 1.0))
    while story.monitor.request.id == first:
        story.goes_on(0.1)
    asked = story.monitor.request
    assert asked.start.time == pytest.approx(begin + 3.0)
    failed = FootholdPlan(0.0, asked.id, reason="a gap")
    monitor = story.goes_on(0.1, foothold_plan=failed, regions_stamp=story.now.time)
    assert monitor.request.id == asked.id + 1 and monitor.request.start.time == pytest.approx(begin + 3.5)
    assert dict(monitor.events) == {BETTER_VIEW: 1} and "a gap" in monitor.reason and not monitor.last_one
    failed = FootholdPlan(0.0, asked.id + 1, reason="the same gap")
    monitor = story.goes_on(0.1, foothold_plan=failed)
    assert monitor.last_one and monitor.request.id == asked.id + 1, "nothing new was seen"
    assert monitor.failed_plans == 2 and monitor.failed_in_a_row == 0


@pytest.mark.parametrize("changes", [{"lead_time": 0.0}, {"goal_tolerance": 1.2, "goal_lost": 2.0}, {}])
def test_no_plan_is_made_ahead_at_the_goal_or_when_it_is_not_wanted(changes):
    story = Story(replace(CONFIG, **changes))
    first = story.until_planning()
    story.goes_on(3.5, reference=trot(first, story.now.time, 8, 1.0))
    assert (story.monitor.request.id > first) == (not changes)


def problem(before, kind="foothold_lost", key=1):
    return Problem(kind, (kind, key), before, "the ground is 0.15 m higher than planned")


def walking_on():
    """A story in which the robot has walked for half a second of eight swings, 4 s long; when they began [s]."""
    story = Story()
    first, begin = story.until_planning(), story.now.time
    story.goes_on(0.1, reference=trot(first, begin, 8, 1.0))
    story.goes_on(0.4)
    return story, first, begin


def sees(story, seconds, *problems):
    """The monitor after region sets for so long that say the same, ten a second."""
    for _ in range(round(10 * seconds)):
        story.goes_on(0.1, problems=problems, regions_stamp=story.now.time)
    story.goes_on(0.0, problems=())
    return story.monitor


def test_a_lost_foothold_cuts_the_reference_before_it_and_asks_for_a_plan_from_there():
    story, first, begin = walking_on()
    lost = problem(begin + 2.05)
    assert sees(story, 0.2, lost).events == () and story.monitor.cut.follows == 0
    monitor = sees(story, 0.2, lost)
    assert dict(monitor.events) == {"foothold_lost": 1}, "once, however often it is said"
    assert (monitor.cut.follows, monitor.cut.time) == (first, pytest.approx(begin + 2.0)), (
        "in the full stance before its lift-off"
    )
    request = monitor.request
    assert (request.id, request.start.follows, request.start.time) == (first + 1, first, monitor.cut.time)
    assert "foothold lost: the ground" in monitor.reason and monitor.phase == "walking"
    joined = trot(request.id, monitor.cut.time, 8, 1.7)
    assert story.goes_on(0.1, reference=joined).followed == request.id and not story.monitor.last_one


def test_what_is_lost_too_late_for_a_plan_ends_in_a_halt_and_a_new_plan():
    story, first, begin = walking_on()
    monitor = sees(story, 0.3, problem(begin + 1.05))
    assert monitor.cut.time == pytest.approx(begin + 1.0) and monitor.request.id == first and monitor.last_one
    halted = story.now.reference.ended_at(monitor.cut.time, story.now.time)
    there = moving(p_WB=halted.states[-1, CentroidalState.POSITION])
    story.goes_on(0.1, reference=halted, state=there)
    assert story.until_planning() == first + 1 and story.monitor.request.start is None
    assert story.monitor.request.keep_off == CONFIG.ground.keep_off, "no plan has failed: it may still be walked round"


def test_a_foot_that_swings_already_is_not_called_back():
    story, _, begin = walking_on()
    monitor = sees(story, 0.3, problem(begin + 0.55))
    assert monitor.cut.follows == 0 and monitor.events == ()


def test_a_pending_plan_that_begins_before_what_was_lost_is_waited_for():
    story, _, begin = walking_ahead()
    asked = story.monitor.request
    monitor = sees(story, 0.3, problem(begin + 3.55))
    assert monitor.request is asked and monitor.cut.time == pytest.approx(begin + 3.5) == pytest.approx(asked.start.time)


def test_a_more_urgent_problem_cuts_the_reference_again():
    story, first, begin = walking_on()
    sees(story, 0.3, problem(begin + 3.05))
    monitor = sees(story, 0.3, problem(begin + 2.05, "way_blocked", 2))
    assert dict(monitor.events) == {"foothold_lost": 1, "way_blocked": 1}
    assert monitor.cut.time == pytest.approx(begin + 2.0) and monitor.request.id == first + 2
    assert sees(story, 0.3, problem(begin + 2.55, key=3)).cut.time == pytest.approx(begin + 2.0)


def test_what_appeared_is_told_to_planners_until_the_robot_has_moved_on():
    def map_of(height):
        heights = np.zeros((400, 400), np.float32)
        heights[290:310, 190:210] = height  # about x = 1.0, y = 0.0
        return GroundHeights(0.0, np.array([-2.0, -2.0]), 0.01, heights)

    story = Story()
    story.now = replace(story.now, ground=map_of(0.0))
    first, begin = story.until_planning(), story.now.time
    story.goes_on(0.1, reference=trot(first, begin, 8, 1.0))
    story.goes_on(0.4, ground=map_of(0.15))
    assert len(story.monitor.appeared) == 0
    lost = replace(problem(begin + 2.05), place=(1.0, 0.05))
    request = sees(story, 0.3, lost).request
    assert request.start is not None and len(request.appeared) == 400
    np.testing.assert_allclose(request.appeared.mean(axis=0), [1.0, 0.0, 0.15], atol=1e-6)
    assert request.keep_off == CONFIG.ground.keep_off
    story.goes_on(0.2, foothold_plan=FootholdPlan(0.0, request.id, reason="no way"))
    story.goes_on(begin + 4.1 - story.now.time, state=moving(p_WB=np.array([1.0, 0.0, 0.58])))
    again = (
        story.monitor.request if story.monitor.phase == "planning" else (story.until_planning(), story.monitor.request)[1]
    )
    assert len(again.appeared) == 400 and again.keep_off == CONFIG.ground.keep_off_least, "nearer, since there was no way"
    far = moving(p_WB=np.array([2.8, 0.0, 0.58]))
    story.goes_on(5.0, state=far, goal=np.array([9.0, 0.0]))
    assert story.monitor.request.id > request.id and len(story.monitor.request.appeared) == 0
