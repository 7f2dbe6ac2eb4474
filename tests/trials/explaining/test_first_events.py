"""Which event came first, on hand-made moments."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.trials.explaining.first_events import BOUNDS, KINDS, chain_of, events_of, rules_in_words, story_of
from quadpips_drake.values.legs import Leg
from tests.trials.explaining.hand_made import free, sliding, standing, tilting, touching, with_swing


def story(moments, end=2.0) -> str:
    return story_of(chain_of(events_of(moments), end), "fell (roll or pitch reached 0.82 rad)", end)


def kinds(moments) -> list[str]:
    return [event.kind for event in events_of(moments)]


def test_a_robot_that_does_what_it_is_asked_to_does_nothing_wrong():
    trot = standing()
    for leg in Leg:
        trot = with_swing(trot, leg, 0.3 + 0.4 * (leg in (Leg.RF, Leg.LH)), 0.7 + 0.4 * (leg in (Leg.RF, Leg.LH)))
    assert kinds(standing()) == kinds(trot) == []
    assert story(trot).startswith("By the rules below nothing led to the end: t = 2.00 s: fell")


def test_small_differences_are_no_events():
    moments = with_swing(standing(), Leg.LF, 0.5, 0.9)
    touching(moments, Leg.LF, 0.86, 0.9, height=0.0, force=(0.0, 0.0, 50.0))
    free(moments, Leg.LF, 0.9, 0.95)
    free(moments, Leg.RH, 1.2, 1.25)
    tilting(moments, 1.0, 0.05)
    sliding(moments, Leg.RF, 1.0, 0.02)
    assert kinds(moments) == []


def test_an_early_contact_comes_first():
    moments = tilting(with_swing(standing(), Leg.LF, 0.5, 0.9), 0.805, 0.5)
    touching(moments, Leg.LF, 0.78, 1.5, height=0.04, force=(-20.0, 0.0, 90.0))
    assert kinds(moments) == ["early contact", "tilt"]
    said = story(moments)
    assert said.startswith("t = 0.78 s: LF touched 0.12 s early, 4 cm below its way: it came down on ground 4 cm above its")
    assert "; then t = 1.01 s: roll is +0.10 rad off; t = 2.00 s: fell" in said


def test_an_edge_on_the_way_is_told_from_ground_by_the_force():
    moments = with_swing(standing(), Leg.RH, 0.5, 0.9)
    touching(moments, Leg.RH, 0.70, 0.75, height=0.02, force=(-90.0, 0.0, 20.0))
    assert "RH touched 0.20 s early, 8 cm below its way: it hit something from the side" in story(moments, end=1.2)


def test_a_late_contact_comes_first():
    moments = free(with_swing(standing(), Leg.RF, 0.5, 0.9), Leg.RF, 0.9, 1.05)
    moments.foothold_ground[:, Leg.RF] = -0.06
    sliding(moments, Leg.LH, 1.0, 0.1)
    assert kinds(moments) == ["late contact", "slip"]
    assert story(moments).startswith(
        "t = 0.90 s: RF came down 0.15 s late; its foothold was 6 cm above the true ground; then"
    )
    never = free(with_swing(standing(), Leg.RF, 0.5, 0.9), Leg.RF, 0.9, 9.0)
    assert "RF found no ground within 1.10 s" in story(never)


def test_a_slip_comes_first():
    moments = tilting(sliding(standing(), Leg.LH, 0.505, 0.2), 0.805, 0.4)
    assert kinds(moments) == ["slip", "tilt"]
    assert story(moments).startswith(
        "t = 0.66 s: LH slipped, by 30 cm until t = 2.00 s; then t = 1.06 s: roll is +0.10 rad off"
    )


def test_a_tilt_comes_first():
    moments = free(tilting(standing(), 0.305, 0.5), Leg.RF, 0.9, 1.2)
    assert kinds(moments) == ["tilt", "lost contact"]
    assert story(moments).startswith(
        "t = 0.51 s: roll is +0.10 rad off; then t = 0.90 s: RF, which was to stand, had no ground"
    )


def test_a_foot_that_stays_behind():
    moments = with_swing(standing(), Leg.LF, 0.5, 0.9)
    touching(moments, Leg.LF, 0.5, 0.9, height=0.0, force=(0.0, 0.0, 90.0))
    assert "t = 0.60 s: LF did not leave the ground" in story(moments, end=1.2)


def test_torques_height_and_place_count_too():
    moments = standing()
    moments.torques[50:60, 2] = -79.9
    moments.base[100:, 2] -= 0.08
    moments.base[150:, 1] += 0.2
    assert kinds(moments) == ["torque", "height", "aside"]
    assert "joint LF_KFE came to its torque limit of 80 N m" in story(moments)
    assert "the base is -0.08 m off its height" in story(moments)


def test_a_joint_at_its_stop_and_the_foot_that_goes_astray():
    moments = with_swing(standing(), Leg.RH, 0.5, 0.9)
    moments.joints[60:70, 10] = 0.999
    moments.feet[65:80, Leg.RH, 0] += 0.06
    assert kinds(moments) == ["joint stop", "astray"]
    said = story(moments, end=1.2)
    assert said.startswith("t = 0.60 s: joint RH_HFE came to its stop at 1.00 rad; then t = 0.65 s: RH was astray, 5 cm")


def test_a_thigh_that_hits_a_step_comes_first():
    moments = tilting(standing(), 0.805, 0.5)
    moments.touches[70:80, LINK_NAMES.index("LF_THIGH")] = True
    moments.touches[190:, LINK_NAMES.index("base")] = True
    assert kinds(moments) == ["link", "tilt", "link"]
    assert story(moments).startswith("t = 0.70 s: LF_THIGH touched something; then t = 1.01 s: roll")


def test_a_robot_that_hits_itself():
    knee = tuple((time, "base", "LF_THIGH") for time in (0.7, 0.71, 0.72))
    moments = replace(tilting(standing(), 0.805, 0.5), itself=knee)
    assert kinds(moments) == ["itself", "tilt"]
    assert story(moments).startswith("t = 0.70 s: LF_THIGH touched the torso: the robot hit itself; then t = 1.01 s: roll")


def test_without_a_reference_the_last_one_counts():
    moments = tilting(standing(), 1.0, 0.5)
    moments.asked_base[80:] = np.nan
    assert kinds(moments) == ["tilt"]
    moments.asked_base[:] = np.nan
    assert kinds(moments) == ["tilt"]


def test_a_yaw_beyond_half_a_turn_is_no_error():
    moments = standing()
    moments.base[:, 5], moments.asked_base[:, 5] = -np.pi + 0.01, np.pi + 0.01
    assert kinds(moments) == []


def test_what_the_safety_monitor_does_is_never_first():
    moments = replace(tilting(standing(), 0.505, 0.5), told=((0.4, "the safety monitor took the reference away: slip"),))
    assert kinds(moments) == ["told", "tilt"]
    assert story(moments).startswith("t = 0.71 s: roll")


def test_what_was_over_long_before_did_not_lead_to_the_end():
    moments = tilting(standing(601), 5.005, 0.5)
    moments.touches[420:425, LINK_NAMES.index("LH_SHANK")] = True
    assert kinds(moments) == ["link", "tilt"]
    assert story(moments, end=6.0).startswith("t = 5.21 s: roll")
    free(moments, Leg.RF, 3.0, 4.6)
    assert story(moments, end=6.0).startswith(
        "t = 3.00 s: RF, which was to stand, had no ground for 1.60 s; then t = 4.20 s"
    )


def test_moments_of_the_end_alone():
    moments = replace(standing(), itself=((0.5, "base", "LF_THIGH"), (1.5, "base", "LF_THIGH"))).since(1.0)
    assert len(moments.time) == len(moments.swing_times) == 101 and moments.time[0] == 1.0
    assert len(moments.itself) == 1 and len(moments.torque_limits) == 12 and moments.joint_limits.shape == (2, 12)


def test_a_robot_that_stands_anew_after_its_reference_was_lost():
    moments = standing(401)
    moments.asked_base[100:] = np.nan
    moments.base[120:, 1] += 0.3
    (event,) = events_of(moments)
    assert (event.kind, event.time, event.until) == ("aside", 1.2, pytest.approx(1.49))


def test_of_each_kind_the_first_is_told():
    moments = sliding(sliding(sliding(standing(), Leg.LF, 0.5, 0.2), Leg.RF, 0.6, 0.2), Leg.RH, 0.7, 0.2)
    assert kinds(moments) == ["slip", "slip", "slip"]
    assert story(moments).count("slipped") == 1


@pytest.mark.parametrize("samples", [1, 2])
def test_hardly_any_moments(samples):
    assert kinds(standing(samples)) == []


def test_all_rules_are_in_words_with_their_numbers():
    words = rules_in_words()
    assert words.keys() == KINDS.keys()
    assert f"more than {BOUNDS.early:g} s before" in words["early contact"]
