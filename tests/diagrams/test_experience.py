"""Experience in the diagram: nothing of it when it is off, and a loop from the swings back to the search when it is on."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.diagrams.planning_module import PlanningConfig, PlanningModule, first_library
from quadpips_drake.errors import UserInputError
from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.experience.experience_file import save_library
from quadpips_drake.planning.experience.experience_recorder_system import ExperienceRecorder
from quadpips_drake.planning.experience.learning import learned
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import FootholdPlan, Stance
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.swing_plan import ExperienceLibrary, SwingOutcome, SwingPlan, SwingReport
from tests.planning.experience.transitions import STANCE, moved, tried


@pytest.fixture(scope="module")
def robot():
    return load_robot("anymal_c")


def config(**keys) -> PlanningConfig:
    return PlanningConfig(experience=ExperienceConfig(**keys))


def test_off_is_not_in_the_diagram(robot):
    module = PlanningModule(robot)
    assert not module.HasOutputPort("experience")
    assert not module.HasSubsystemNamed("experience_recorder")
    assert not module.GetSubsystemByName("foothold_planner").HasInputPort("experience")


def test_with_a_scope_the_search_gets_what_was_learned(robot):
    module = PlanningModule(robot, config(scope="site"), site="a place")
    library = module.GetOutputPort("experience").Eval(module.CreateDefaultContext())
    assert (library.scope, library.robot, library.site, len(library)) == ("site", "anymal_c", "a place", 0)
    assert module.GetSubsystemByName("foothold_planner").HasInputPort("experience")


def test_a_file_is_where_it_begins_and_must_fit(robot, tmp_path):
    path = tmp_path / "experience.npz"
    settings = config(scope="general")
    save_library(path, learned(first_library(robot, settings), [tried()], settings.experience))
    begun = replace(settings, experience=replace(settings.experience, file=str(path)))
    assert len(first_library(robot, begun, "anywhere")) == 1
    for other in (
        replace(begun, experience=replace(begun.experience, scope="site")),
        replace(begun, experience=replace(begun.experience, failure_cost=1.0)),
        replace(begun, swings=replace(begun.swings, time_step=0.02)),
    ):
        with pytest.raises(UserInputError, match="made for another"):
            PlanningModule(robot, other)
    faster = replace(begun, swings=replace(begun.swings, rate=10.0), experience=replace(begun.experience, weight=9.0))
    assert len(first_library(robot, faster)) == 1


def test_the_recorder_learns_once_from_each_plan():
    after = moved(STANCE)
    stances = [
        Stance(feet, np.tile([0.0, 0.0, 1.0], (4, 1)), (None,) * 4, np.zeros(3), np.zeros(3)) for feet in (STANCE, after)
    ]
    plan = FootholdPlan(0.0, 1, tuple(stances), ((Leg.LF, Leg.RH),), "standing_trot", 0.4, 0.1)
    report = SwingReport((Leg.LF, Leg.RH), "a foot would go through 9.0 cm of ground")
    recorder = ExperienceRecorder(ExperienceConfig(scope="site"), ExperienceLibrary(scope="site"))
    simulator = Simulator(recorder)
    context = simulator.get_mutable_context()

    def update(plan, swings) -> ExperienceLibrary:
        recorder.GetInputPort("foothold_plan").FixValue(context, AbstractValue.Make(plan))
        recorder.GetInputPort("swing_plan").FixValue(context, AbstractValue.Make(swings))
        simulator.AdvanceTo(context.get_time() + 1.0 / recorder.config.rate)
        return recorder.GetOutputPort("experience").Eval(context)

    assert len(update(plan, SwingPlan.empty())) == 0
    tried_once = SwingPlan(replace(WholeBodyReference.empty(0.0), request_id=1), reports=(report,))
    library = update(plan, tried_once)
    assert (len(library), library.status[0], library.trials) == (1, SwingOutcome.FAILED, 1)
    assert update(plan, tried_once).trials == 1
    other = SwingPlan(replace(WholeBodyReference.empty(0.0), request_id=2), reports=(report,))
    assert update(plan, other).trials == 1, "not of this foothold plan"
