"""What is remembered of swings that were tried."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.gaits.swing_gaits import swing_gait
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.experience.learning import learned, tried_swings
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import FootholdPlan, RefusedSwing, Stance
from quadpips_drake.values.swing_plan import ExperienceLibrary, SwingOutcome, SwingPlan, SwingReport
from tests.planning.experience.transitions import STANCE, moved, tried

CONFIG = ExperienceConfig()
SITE = ExperienceLibrary(scope="site")


def test_a_record_holds_the_running_mean_and_the_last_status():
    library = SITE
    for dearer, outcome in ((4.0, SwingOutcome.CONVERGED), (8.0, SwingOutcome.UNCONVERGED), (6.0, SwingOutcome.CONVERGED)):
        library = learned(library, [tried(CONFIG.easy_cost + dearer, outcome)], CONFIG)
    assert (len(library), library.trials, library.count[0], library.last[0]) == (1, 3, 3, 3)
    assert library.cost[0] == pytest.approx(6.0)
    assert library.status[0] == SwingOutcome.CONVERGED
    assert library.legs[0] == 0b1001
    assert len(SITE) == 0  # nothing changes in place


def test_a_failed_swing_counts_the_failure_cost_whatever_the_solver_said():
    library = learned(SITE, [tried(2.0, SwingOutcome.FAILED)], CONFIG)
    assert library.cost[0] == CONFIG.failure_cost
    assert library.status[0] == SwingOutcome.FAILED
    assert learned(SITE, [tried(np.nan)], CONFIG).status[0] == SwingOutcome.FAILED
    assert learned(SITE, [tried(1e9)], CONFIG).cost[0] == CONFIG.failure_cost
    assert learned(SITE, [tried(-1e9)], CONFIG).cost[0] == 0.0


@pytest.mark.parametrize(
    "other",
    [
        tried(by=(0.3 + 1.5 * CONFIG.same, 0.0, 0.0)),
        tried(before=STANCE + np.array([1.5 * CONFIG.same, 0.0, 0.0])),
        tried(legs=(Leg.LF,)),
        tried(phase=1),
    ],
    ids=["elsewhere", "from elsewhere", "other legs", "other phase"],
)
def test_other_transitions_have_their_own_records(other):
    assert len(learned(SITE, [tried(), other], CONFIG)) == 2


def test_general_experience_is_the_same_wherever_the_stance_is():
    turned = STANCE @ yaw_matrix(0.7).T + [3.0, -2.0, 0.4]
    elsewhere = tried(before=turned, by=yaw_matrix(0.7) @ [0.3, 0.0, 0.0])
    general = learned(ExperienceLibrary(), [tried(), elsewhere], CONFIG)
    assert (len(general), general.count[0]) == (1, 2)
    np.testing.assert_allclose(general.before[0].mean(axis=0), 0.0, atol=1e-12)
    assert len(learned(SITE, [tried(), elsewhere], CONFIG)) == 2


def test_what_was_used_least_goes_first_and_the_oldest_of_that():
    config = replace(CONFIG, max_records=2)
    places = [tried(by=(x, 0.0, 0.0)) for x in (0.1, 0.2, 0.3, 0.4)]
    library = SITE
    for attempt in (places[0], places[0], places[1], places[2]):
        library = learned(library, [attempt], config)
    np.testing.assert_allclose(library.after[:, 0, 0] - STANCE[0, 0], [0.1, 0.3])
    library = learned(library, [places[3]], config)
    np.testing.assert_allclose(library.after[:, 0, 0] - STANCE[0, 0], [0.1, 0.4])


def _plan(swings: int) -> FootholdPlan:
    stances, legs, feet = [], [], STANCE
    for k in range(swings + 1):
        stances.append(Stance(feet, np.tile([0.0, 0.0, 1.0], (4, 1)), (None,) * 4, np.zeros(3), np.zeros(3)))
        legs.append(((Leg.LF, Leg.RH), (Leg.RF, Leg.LH))[k % 2])
        feet = moved(feet, legs[-1])
    return FootholdPlan(0.0, 7, tuple(stances), tuple(legs[:-1]), "standing_trot", 0.4, 0.1)


def test_only_swings_that_were_tried_are_learned():
    plan = _plan(4)
    reports = [SwingReport(legs, "converged", cost=5.0, number=k) for k, legs in enumerate(plan.swing_legs[:2])]
    reports.append(SwingReport(plan.swing_legs[2], "a foot would land 9 cm from its foothold", number=2, cost=3.0))
    attempts = tried_swings(plan, SwingPlan.without_motion(0.0, 7, reports=tuple(reports)))
    assert [attempt.outcome for attempt in attempts] == [SwingOutcome.CONVERGED] * 2 + [SwingOutcome.FAILED]
    phases = swing_gait(plan.gait).phases
    assert [set(phases[attempt.phase]) for attempt in attempts] == [set(legs) for legs in plan.swing_legs[:3]]
    np.testing.assert_array_equal(attempts[2].after, plan.stances[3].footholds)


def test_a_swing_without_a_configuration_was_tried_too():
    plan = _plan(2)
    refused = RefusedSwing(plan.swing_legs[1], plan.stances[1].footholds, plan.stances[2].footholds, "out of reach")
    swings = SwingPlan.without_motion(
        0.0, 7, reports=(SwingReport(plan.swing_legs[0], "converged", cost=4.0),), refused=refused
    )
    assert [attempt.outcome for attempt in tried_swings(plan, swings)] == [SwingOutcome.CONVERGED, SwingOutcome.FAILED]
