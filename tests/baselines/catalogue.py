"""One instance of every LeafSystem of this part, for the test that compares docstrings with ports."""

from quadpips_drake.baselines.motion_models.command_sequence import HeldCommand
from quadpips_drake.baselines.motion_models.command_sequence_system import SequencedCommand
from quadpips_drake.robots.robot_library import load_robot


def make_systems() -> list:
    return [SequencedCommand(load_robot("anymal_c"), "trot", [HeldCommand((0.3, 0.0, 0.0), 1)])]
