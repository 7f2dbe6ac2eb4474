"""The system that runs the network."""

import numpy as np
import pytest
import torch
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.learning.model import SteppabilityModel
from quadpips_drake.learning.network import SteppabilityNetwork
from quadpips_drake.learning.steppability_segmenter_system import SteppabilitySegmenter
from quadpips_drake.robots.oracle_state_estimator import empty_robot_state
from quadpips_drake.robots.robot_model import load_robot
from quadpips_drake.timing import StageTimings
from tests.learning.small import NETWORK, SMALL, floor_depth


@pytest.fixture(scope="module")
def model():
    torch.manual_seed(0)
    return SteppabilityModel(SteppabilityNetwork(NETWORK))


def simulate(model, image, until):
    """Returns the labels at the time ``until`` [s] and how often the network ran."""
    builder, timings = DiagramBuilder(), StageTimings()
    segmenter = builder.AddSystem(
        SteppabilitySegmenter(load_robot("anymal_c").camera().X_BC, SMALL, model=model, timings=timings)
    )
    for name, value in (("depth_image", image), ("robot_state", empty_robot_state())):
        source = builder.AddSystem(ConstantValueSource(AbstractValue.Make(value)))
        builder.Connect(source.get_output_port(), segmenter.GetInputPort(name))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(until)
    context = segmenter.GetMyContextFromRoot(simulator.get_context())
    runs = timings.summary_ms().get("steppability", {"n": 0})["n"]
    return segmenter.GetOutputPort("labels").Eval(context), runs


def depth_image(depth):
    image = ImageDepth32F(depth.shape[1], depth.shape[0])
    image.mutable_data[:, :, 0] = depth
    return image


def test_five_label_images_a_second(model):
    labels, runs = simulate(model, depth_image(floor_depth()), 0.95)
    assert labels.labels.shape == (48, 64)
    assert runs == 5
    assert labels.stamp == empty_robot_state().stamp  # the time of the image, not of the reading


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0])
def test_images_without_measurements_give_unknown(model, value):
    labels, _ = simulate(model, depth_image(np.full((48, 64), value)), 0.1)
    assert labels.labels.shape == (48, 64) and not labels.labels.any()


def test_an_image_of_another_size_gives_no_labels(model):
    labels, _ = simulate(model, depth_image(np.ones((10, 12))), 0.1)
    assert labels.labels.size == 0
