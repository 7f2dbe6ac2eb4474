"""The network in the diagram of the perception."""

from quadpips_drake.diagrams.perception_module import PerceptionModule
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.steppability.steppability_config import SteppabilityConfig
from quadpips_drake.robots.robot_library import load_robot
from tests.learning.small import SMALL


def test_the_network_replaces_the_input_port_for_labels():
    robot = load_robot("anymal_c")
    without = PerceptionModule(robot, SMALL, PerceptionConfig())
    assert without.HasInputPort("labels") and not without.HasSubsystemNamed("steppability_segmenter")
    config = PerceptionConfig(steppability=SteppabilityConfig(enabled=True))
    with_network = PerceptionModule(robot, SMALL, config)
    assert not with_network.HasInputPort("labels")
    segmenter = with_network.GetSubsystemByName("steppability_segmenter")
    normals = with_network.GetSubsystemByName("normal_estimator")
    wires = {
        (a[0].get_name(), a[0].get_output_port(a[1]).get_name(), b[0].get_name())
        for b, a in with_network.connection_map().items()
    }
    assert (segmenter.get_name(), "labels", normals.get_name()) in wires
