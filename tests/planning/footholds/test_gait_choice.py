"""Pairs of legs swing where the ground is generous, single ones where it is not."""

import numpy as np
import pytest

from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.gait_choice import need_of_care
from tests.planning.footholds.test_foothold_search import NOMINAL, WORLDS, plan_once

CONFIG = FootholdConfig()


def stances(**last):
    """Two nominal stances, the second one turned to the left and changed: (2, 4, 3) and (2, 3)."""
    feet, rpy = np.tile(NOMINAL * [1.0, 1.0, 0.0], (2, 1, 1)), np.zeros((2, 3))
    feet[1] *= [1.0, last.get("width", 1.0), 1.0]
    feet[1, 0, 2] += last.get("rise", 0.0)
    rpy[1, 0] = last.get("roll", 0.0)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    feet[1], rpy[1, 2] = feet[1] @ turn.T, np.pi / 2
    return feet, rpy


@pytest.mark.parametrize(
    ("change", "need"),
    [
        ({}, ""),
        ({"rise": 0.10}, ""),
        ({"rise": -0.20}, "a foot rises or sinks by 0.20 m"),
        ({"roll": -0.3}, "the base rolls by 0.30 rad"),
        ({"width": 0.3}, "a stance is 0.10 m wide"),
    ],
)
def test_what_asks_for_care(change, need):
    assert need_of_care(*stances(**change), CONFIG) == need


def test_nothing_asks_for_it_without_a_plan():
    assert need_of_care(np.zeros((0, 4, 3)), np.zeros((0, 3)), CONFIG) == ""


def test_the_plan_says_which_gait_and_why():
    usual, narrow = plan_once(*WORLDS["flat"], CONFIG), plan_once(*WORLDS["beam"], CONFIG)
    assert (usual.gait, usual.gait_reason) == (CONFIG.gait, "")
    assert narrow.gait == CONFIG.careful_gait and "wide" in narrow.gait_reason
    assert all(len(legs) == 1 for legs in narrow.swing_legs)
