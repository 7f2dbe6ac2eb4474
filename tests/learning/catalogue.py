"""One instance of every system of the learning."""

from pydrake.systems.framework import LeafSystem

from quadpips_drake.perception.steppability.model import SteppabilityModel
from quadpips_drake.perception.steppability.network import SteppabilityNetwork
from quadpips_drake.perception.steppability.steppability_segmenter_system import SteppabilitySegmenter
from quadpips_drake.robots.robot_library import load_robot
from tests.learning.small import SMALL


def make_systems() -> list[LeafSystem]:
    """Returns an instance of each."""
    model = SteppabilityModel(SteppabilityNetwork())
    return [SteppabilitySegmenter(load_robot("anymal_c").camera().X_BC, SMALL, model=model)]
