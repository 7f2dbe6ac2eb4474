"""One instance of every system of this stage, for the test that compares docstrings with ports."""

from pydrake.systems.framework import LeafSystem

from quadpips_drake.faults.failing_mpc_system import FailingMpc
from quadpips_drake.faults.push_system import PushSource
from quadpips_drake.faults.raised_footholds_system import RaisedFootholds
from quadpips_drake.robots.robot_library import load_robot


def make_systems() -> list[LeafSystem]:
    return [FailingMpc(load_robot("anymal_c")), PushSource([], None), RaisedFootholds(0.03)]
