"""What transitions cost by experience, held against the formula written out."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.planning.experience.edge_experience import EdgeExperience
from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.experience.learning import RECORD_FIELDS, learned
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.swing_plan import ExperienceLibrary, SwingOutcome
from tests.planning.experience.transitions import PAIR, STANCE, moved, tried

CONFIG = ExperienceConfig(scope="site")
SITE = ExperienceLibrary(scope="site")
LEGS = np.array([int(leg) for leg in PAIR])


def costs(library, after, before=STANCE, legs=LEGS, config=CONFIG):
    return EdgeExperience.of(library, config).costs(legs, before, np.array(after))


def written_out(library, before, after, legs, config):
    """The formula of docs/experience.md, record by record; what is far away counts a little here."""
    mass = total = 0.0
    for k in range(len(library)):
        if library.legs[k] != sum(1 << int(leg) for leg in legs):
            continue
        apart = sum(((after[leg] - library.after[k, leg]) ** 2).sum() for leg in legs) / (2 * config.width**2)
        apart += ((before - library.before[k]) ** 2).sum() / (2 * config.start_width**2)
        mass += library.count[k] * np.exp(-apart)
        total += library.count[k] * np.exp(-apart) * library.cost[k]
    return config.weight * np.tanh(total / max(1.0, mass) / config.scale)


def random_library(rng, count, scope="site"):
    empty = ExperienceLibrary(scope=scope, trials=9)
    arrays = {
        "phase": rng.integers(0, 2, count),
        "legs": rng.choice([0b1001, 0b0110, 0b0001], count),
        "before": STANCE + 0.03 * rng.standard_normal((count, 4, 3)),
        "after": STANCE + 0.1 * rng.standard_normal((count, 4, 3)),
        "count": rng.integers(1, 5, count),
        "cost": rng.uniform(0.0, CONFIG.failure_cost, count),
        "status": rng.integers(0, 3, count),
        "last": rng.integers(1, 9, count),
    }
    return replace(empty, **{name: arrays[name].astype(getattr(empty, name).dtype) for name in RECORD_FIELDS})


def test_costs_are_those_of_the_formula():
    rng = np.random.default_rng(0)
    library = random_library(rng, 60)
    for legs in (LEGS, np.array([0])):
        places = [STANCE[leg] + 0.05 * rng.standard_normal((4, 3)) for leg in legs]
        after = []
        for a in places[0]:
            for b in places[-1]:
                feet = STANCE.copy()
                feet[legs[0]], feet[legs[-1]] = a, b if len(legs) > 1 else a
                after.append(feet)
        found = costs(library, after, legs=legs)
        expected = [written_out(library, STANCE, feet, legs, CONFIG) for feet in after]
        # Records three standard deviations away are left out.
        np.testing.assert_allclose(found, expected, atol=0.12 * CONFIG.weight)
        assert np.corrcoef(found, expected)[0, 1] > 0.99
        assert (found >= 0.0).all()
        assert (found <= CONFIG.weight).all()


def test_the_transition_itself_costs_what_its_mean_says():
    library = learned(SITE, [tried(CONFIG.easy_cost + 30.0)], CONFIG)
    assert costs(library, [moved(STANCE)])[0] == pytest.approx(CONFIG.weight * np.tanh(30.0 / CONFIG.scale))
    failed = learned(SITE, [tried(outcome=SwingOutcome.FAILED)], CONFIG)
    assert costs(failed, [moved(STANCE)])[0] > 0.99 * CONFIG.weight


def test_what_was_never_tried_costs_nothing():
    library = learned(SITE, [tried(outcome=SwingOutcome.FAILED)], CONFIG)
    far = moved(STANCE, by=(0.3, 0.5, 0.0))
    assert costs(library, [far])[0] == 0.0
    assert costs(library, [moved(STANCE, (Leg.RF,))], legs=np.array([1]))[0] == 0.0
    assert costs(library, [moved(STANCE + 1.0)], before=STANCE + 1.0)[0] == 0.0
    assert EdgeExperience.of(SITE, CONFIG) is None


def test_it_fades_with_the_distance_of_a_foot():
    library = learned(SITE, [tried(outcome=SwingOutcome.FAILED)], CONFIG)
    values = costs(library, [moved(STANCE, by=(0.3 + x, 0.0, 0.0)) for x in (0.0, 0.03, 0.06, 0.09)])
    assert (np.diff(values) < 0.0).all()


def test_successes_outweigh_a_failure_as_they_grow_in_number():
    library = learned(SITE, [tried(outcome=SwingOutcome.FAILED)], CONFIG)
    before = costs(library, [moved(STANCE)])[0]
    for _ in range(8):
        library = learned(library, [tried()], CONFIG)
    assert costs(library, [moved(STANCE)])[0] < 0.6 * before


def test_general_experience_counts_wherever_the_robot_stands():
    library = learned(ExperienceLibrary(), [tried(outcome=SwingOutcome.FAILED)], CONFIG)
    before = STANCE @ yaw_matrix(-0.4).T + [2.0, 1.0, 0.2]
    after = moved(before, by=yaw_matrix(-0.4) @ [0.3, 0.0, 0.0])
    assert costs(library, [after], before=before)[0] > 0.99 * CONFIG.weight


def test_what_is_old_is_forgotten_only_with_a_half_life():
    library = learned(SITE, [tried(outcome=SwingOutcome.FAILED)], CONFIG)
    for _ in range(10):
        library = learned(library, [], CONFIG)
    assert costs(library, [moved(STANCE)])[0] > 0.99 * CONFIG.weight
    forgetful = replace(CONFIG, half_life=2.0)
    # After five half-lives 1/32 of the attempt is left.
    expected = CONFIG.weight * np.tanh(CONFIG.failure_cost / 32 / CONFIG.scale)
    assert costs(library, [moved(STANCE)], config=forgetful)[0] == pytest.approx(expected)


def test_failures_lead_the_search_elsewhere():
    from quadpips_drake.planning.experience.learning import tried_swing
    from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
    from quadpips_drake.planning.footholds.foothold_search import search_footholds
    from quadpips_drake.planning.torso.torso_config import TorsoConfig
    from quadpips_drake.planning.torso.torso_search import search_torso_path
    from quadpips_drake.robots.robot_library import load_robot
    from tests.planning.worlds import flat_ground, standing_state

    robot, regions = load_robot("anymal_c"), flat_ground()
    state = standing_state(robot)
    path = search_torso_path(state.p_WB, 0.0, regions, np.array([1.5, 0.0]), robot, TorsoConfig(), request_id=1)
    config = FootholdConfig()

    def search(library):
        return search_footholds(state, regions, path, robot, config, experience=EdgeExperience.of(library, CONFIG))

    def feet(plan):
        return np.array([stance.footholds for stance in plan.stances])

    first = search(SITE)
    np.testing.assert_array_equal(feet(first), feet(search_footholds(state, regions, path, robot, config)))
    failed = [tried_swing(first, 0, SwingOutcome.FAILED, np.nan)]
    second = search(learned(SITE, failed, CONFIG))
    assert second.success
    moved_legs = [int(leg) for leg in first.swing_legs[0]]
    if second.swing_legs[0] == first.swing_legs[0]:
        apart = np.linalg.norm(feet(second)[1, moved_legs] - feet(first)[1, moved_legs], axis=1)
        assert apart.max() > CONFIG.width
