"""explain.html: of invented trials and of a real one; and that nothing changes when it is asked for."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.torso.subgoals import Exploration
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trials.explaining import plan_stories, trial_explanation
from quadpips_drake.trials.explaining.explainer import Explainer
from quadpips_drake.trials.explaining.plan_stories import FIRST, LAST, PlanRecorder
from quadpips_drake.trials.explaining.trial_explanation import explanation_of
from quadpips_drake.trials.record import record_trial
from quadpips_drake.trials.result import TrialResult
from quadpips_drake.trials.trial import TrialConfig, run_trial
from quadpips_drake.trials.trial_options import resolve_config
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import PlanRequest, PlanStart, RefusedSwing
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.status import PlannerPhase, PlannerStatus
from quadpips_drake.values.swing_plan import SwingPlan, SwingReport
from tests.planning.worlds import pit, standing_state, stepping_stones
from tests.trials.explaining.hand_made import standing, tilting, touching, with_swing
from tests.trials.toy_trial import ToyConfig, ToyTrial

GOAL = np.array([3.5, 0.0])
FLAT = load_terrain("flat", 0)


class Reader(HTMLParser):
    """Checks that every element is closed, collects what the page links to and its text."""

    VOID = frozenset({"meta", "img", "br"})

    def __init__(self, page: str):
        super().__init__()
        self._open, self.targets, self.ids, self.text = [], [], set(), ""
        self.pictures = 0
        self.feed(page)
        self.close()
        assert not self._open, f"not closed: {self._open}"

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.targets += [found[name] for name in ("src", "href", "data", "action", "srcset") if name in found]
        self.ids |= {found["id"]} if "id" in found else set()
        self.pictures += tag == "img"
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.text += data


def read(page: str) -> Reader:
    """The page, after it was seen to be whole and to need no network."""
    assert page.startswith("<!DOCTYPE html>")
    reader = Reader(page)
    for target in reader.targets:
        assert target.startswith("data:image/png;base64,") or target[1:] in reader.ids, target[:80]
    assert not re.findall(r"(?:https?:)?//[\w.]+\.\w+|@import|url\(", re.sub(r"base64,[\w+/=]+", "", page))
    return reader


@pytest.fixture(scope="module")
def robot():
    return load_robot("anymal_c")


def planned(robot, regions, request: PlanRequest, state=None, tried: Exploration | None = None) -> dict:
    """What the searches answer, and swings as if they had been optimised."""
    state = state or standing_state(robot)
    path = search_torso_path(
        state.p_WB, 0.0, regions, request.goal, robot, TorsoConfig(), request_id=request.id, exploration=tried
    )
    path = replace(path, start=request.start)
    plan = search_footholds(state, path.regions, path, robot, FootholdConfig())
    answers = {"torso_path": path, "foothold_plan": plan}
    if plan.success:
        reports = tuple(
            SwingReport(legs, "converged", 6, 1.0, 3e-4, 0.002, 0.03, number)
            for number, legs in enumerate(plan.swing_legs[:-1])
        )
        refused = RefusedSwing(plan.swing_legs[-1], plan.stances[-2].footholds, plan.stances[-1].footholds, "<out of> reach")
        reference = replace(WholeBodyReference.empty(0.0), request_id=request.id, times=np.zeros(1))
        answers["swing_plan"] = SwingPlan(reference, reports, len(plan.swing_legs), reason="<out of> reach", refused=refused)
    return answers


def note(recorder, robot, request, status, answers, stamp=0.5, published=True):
    state = standing_state(robot, stamp=stamp)
    reference = WholeBodyReference.empty()
    if published:
        reference = replace(reference, request_id=request.id, times=np.zeros(2))
    recorder.note(state, request, status, WholeBodyReference.empty(), {}, FLAT)
    recorder.note(replace(state, stamp=stamp + 0.1), request, status, reference, answers, FLAT)


def explained(robot, explainer, result) -> str:
    log = SimpleNamespace(arrays=dict)
    trial = SimpleNamespace(robot=robot, present_terrain=FLAT, config=None, log=log, title=lambda: "anymal_c on <flat>")
    return explanation_of(trial, explainer, result)


def result(success, reason, detail="", **fields) -> TrialResult:
    return TrialResult(success, reason, "anymal_c", "flat", "quadpips", 3, detail, sim_time=2.0, **fields)


def test_the_page_of_a_success(robot):
    explainer = Explainer()
    first = PlanRequest(1, 0.5, GOAL)
    start = PlanStart(1, 2.0, np.zeros(24))
    second = PlanRequest(2, 1.0, GOAL, start)
    status = PlannerStatus(0.5, PlannerPhase.PLANNING, "the robot <stands>")
    note(explainer.plans, robot, first, status, planned(robot, stepping_stones(), first))
    walking = PlannerStatus(1.0, PlannerPhase.WALKING, "foothold lost: LF", events={"foothold_lost": 1})
    note(explainer.plans, robot, second, walking, planned(robot, stepping_stones(), second), stamp=1.0)
    page = read(explained(robot, explainer, result(True, "goal_reached")))
    assert page.pictures == 2, "a map for each plan, nothing about an end"
    for text in (
        "anymal_c on <flat>, seed 3",
        "success: goal reached at t = 2.00 s",
        "from a stand",
        "the robot <stands>",
        "foothold lost: LF: to go on from plan 1 at t = 2.00 s, 1.00 s ahead",
        "joined to the plan before it from t = 1.10 s on, but ends early: <out of> reach",
        "gait standing_trot, the planner's;",
        "expansions in",
        "none: permitted",
        "no motion was found: <out of> reach",
        "3.0e-04",
    ):
        assert text in page.text, text
    assert "m to the goal; " in page.text or "m to a sub-goal nearer to the goal, " in page.text
    plan = explainer.plans.stories[0].foothold_plan
    assert plan.refusals
    for constraint, count in plan.refusals.items():
        assert f"{constraint}{count}" in page.text, "names and numbers in cells beside each other"


def test_the_page_of_an_invented_fall(robot, monkeypatch):
    moments = tilting(with_swing(standing(), Leg.LF, 0.5, 0.9), 0.8, 0.5)
    touching(moments, Leg.LF, 0.78, 1.5, height=0.04, force=(-20.0, 0.0, 90.0))
    monkeypatch.setattr(trial_explanation, "moments_of", lambda log, robot, terrain: moments)
    page = read(explained(robot, Explainer(), result(False, "fell", "roll or pitch reached 0.82 rad")))
    assert page.pictures == 1
    assert "t = 0.78 s: LF touched 0.12 s early, 4 cm below its way" in page.text
    assert "No plan was asked for" in page.text
    assert "a foot touches while it swings, more than 0.06 s before its touch-down" in page.text, "the rules"


def test_the_page_of_a_planner_that_gave_up(robot):
    explainer = Explainer()
    request = PlanRequest(1, 0.5, GOAL)
    status = PlannerStatus(0.5, PlannerPhase.PLANNING, "the robot stands")
    state = standing_state(robot, x=0.45)
    all_seen = Exploration(GOAL, np.array([[0.45, 0.0, 0.0]]), detour=1000)
    answers = planned(robot, pit(), request, state, all_seen)
    assert not answers["torso_path"].success
    nodes = answers["torso_path"].nodes
    assert nodes[answers["torso_path"].reached][:, 0].max() < 0.8 < 1.8 < nodes[~answers["torso_path"].reached][:, 0].min()
    note(explainer.plans, robot, request, status, answers, published=False)
    page = read(explained(robot, explainer, result(False, "no_plan", "5 plans in a row failed: the way is blocked")))
    assert "Why there is no plan" in page.text
    assert answers["torso_path"].reason in page.text
    assert "the way is blocked: a gap 1.2" in page.text
    assert "Red nodes are poses with ground for all legs that no way leads to" in page.text
    assert page.pictures == 2, "the last map is shown with the reason, too"


def test_a_long_trial_keeps_its_first_and_last_plans(robot):
    recorder, status = PlanRecorder(), PlannerStatus(0.0, PlannerPhase.PLANNING)
    for number in range(1, 101):
        request = PlanRequest(number, float(number), GOAL)
        recorder.note(standing_state(robot, stamp=float(number)), request, status, WholeBodyReference.empty(), {}, FLAT)
    kept = [story.request.id for story in recorder.stories]
    assert kept == [*range(1, FIRST + 1), *range(101 - LAST, 101)]
    assert recorder.left_out == 100 - FIRST - LAST
    assert plan_stories.STAGES == ("torso_path", "foothold_plan", "swing_plan")


def test_what_breaks_in_the_looking_does_not_break_the_trial(tmp_path, monkeypatch):
    def broken(*_):
        raise SystemExit("Failure at planner.cc:1 in HasOutputPort(): condition 'ok' failed.")

    monkeypatch.setattr("quadpips_drake.trials.record.remove_broken_kernels", list)
    monkeypatch.setattr(Explainer, "_look", broken)
    done = record_trial(ToyTrial, ToyConfig(duration=0.1), tmp_path, recording=False, explain=True, warm_up=lambda: None)
    assert done.success
    page = read((tmp_path / "explain.html").read_text())
    assert "the looking broke off at t = 0.00 s" in page.text


@pytest.mark.slow
def test_explaining_changes_no_bit(tmp_path):
    sets = ["stages.region_source=oracle", "duration=2.2"]
    config = resolve_config(TrialConfig, None, {"terrain": "flat", "seed": 1}, sets)
    for name in ("without", "with"):
        run_trial(config, tmp_path / name, recording=False, explain=name == "with")
    plain, explained = (np.load(tmp_path / name / "log.npz") for name in ("without", "with"))
    assert plain.files == explained.files
    for array in plain.files:
        assert plain[array].tobytes() == explained[array].tobytes(), array
    assert not (tmp_path / "without" / "explain.html").exists()
    page = read((tmp_path / "with" / "explain.html").read_text())
    assert "failure: timeout" in page.text
    assert "Plan 1" in page.text
    assert re.search(r"\d swings to(wards)? the waypoint", page.text)
    assert "Nothing went wrong at the end by the rules for falls" in page.text
    assert (tmp_path / "with" / "explain.html").stat().st_size < 2_000_000
