"""The system that runs the network."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.steppability.steppability_config import SteppabilityConfig
from quadpips_drake.perception.steppability.steppability_segmenter_system import SteppabilitySegmenter
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import AffordanceImage
from tests.learning.small import SMALL, floor_depth

STAMP = 0.25
"""Time of exposure of the images [s]."""


def simulate(model, depth, until, config=None, X_WC=None):
    """Returns the labels at the time ``until`` [s] and how often the network ran."""
    builder, timings = DiagramBuilder(), StageTimings()
    segmenter = builder.AddSystem(SteppabilitySegmenter(SMALL, config, model=model, timings=timings))
    source = builder.AddSystem(ConstantValueSource(AbstractValue.Make(affordance_image(depth, X_WC))))
    builder.Connect(source.get_output_port(), segmenter.GetInputPort("affordance_image"))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(until)
    context = segmenter.GetMyContextFromRoot(simulator.get_context())
    runs = timings.summary_ms().get("steppability", {"n": 0})["n"]
    return segmenter.GetOutputPort("labels").Eval(context), runs


def affordance_image(depth, X_WC=None):
    """An image of which only the depth [m] and the pose matter."""
    X_WC = load_robot("anymal_c").camera().X_BC if X_WC is None else X_WC
    depth = np.asarray(depth, np.float32)
    nothing = np.full((*depth.shape, 3), np.nan, np.float32)
    return AffordanceImage(STAMP, X_WC, SMALL, depth, nothing, np.zeros(depth.shape, np.uint8))


def test_five_label_images_a_second(model):
    labels, runs = simulate(model, floor_depth(), 0.95)
    assert labels.labels.shape == (48, 64)
    assert runs == 5
    assert labels.stamp == STAMP  # the time of the image, not of the reading


@pytest.mark.parametrize("latency", [0.0, 0.05])
def test_labels_appear_after_their_latency(model, latency):
    config = SteppabilityConfig(rate=5.0, latency=latency)
    image = floor_depth()
    if latency > 0:
        labels, runs = simulate(model, image, 0.5 * latency, config)
        assert labels.labels.size == 0 and runs == 1
    labels, _ = simulate(model, image, latency + 0.01, config)
    assert labels.labels.any()


def test_labels_belong_to_the_image_that_they_were_made_for(model):
    """The world changes between sampling and showing; the labels must still come with the old image."""
    segmenter = SteppabilitySegmenter(SMALL, SteppabilityConfig(latency=0.1), model=model)
    simulator = Simulator(segmenter)
    context = simulator.get_mutable_context()
    for depth, until in ((0.5, 0.05), (0.7, 0.15)):
        image = affordance_image(np.full((48, 64), depth))
        segmenter.GetInputPort("affordance_image").FixValue(context, AbstractValue.Make(image))
        simulator.AdvanceTo(until)
    shown = segmenter.GetOutputPort("labels").Eval(context)
    np.testing.assert_allclose(shown.depth, 0.5)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, -1.0, 3.1, 65.535, 1e30])
def test_images_without_measurements_give_unknown(model, value):
    """Empty, all-zero and saturated images: nothing is known, and nothing fails."""
    labels, _ = simulate(model, np.full((48, 64), value), 0.1)
    assert labels.labels.shape == (48, 64) and not labels.labels.any()


def test_a_single_valid_pixel_is_labelled_alone(model):
    depth = np.full((48, 64), np.nan)
    depth[20, 30] = 1.0
    labels, _ = simulate(model, depth, 0.1)
    assert labels.labels[20, 30] > 0 and np.count_nonzero(labels.labels) == 1


@pytest.mark.parametrize("shape", [(10, 12), (64, 48), (96, 128), (1, 1)])
def test_an_image_of_another_size_gives_no_labels(model, shape):
    labels, _ = simulate(model, np.ones(shape), 0.1)
    assert labels.labels.size == 0


def test_an_empty_image_gives_no_labels(model):
    labels, _ = simulate(model, np.zeros((0, 0)), 0.1)
    assert labels.labels.size == 0


@pytest.mark.parametrize(
    "position, known", [(np.full(3, np.nan), False), (np.full(3, np.inf), False), (np.full(3, 1e9), True)]
)
def test_poses_that_are_not_numbers_give_no_labels(model, position, known):
    X_WC = load_robot("anymal_c").camera().X_BC.copy()
    X_WC[:3, 3] = position
    labels, _ = simulate(model, floor_depth(), 0.1, X_WC=X_WC)
    assert labels.labels.any() == known


def test_the_latency_is_checked():
    for latency in (-0.1, 10.1, np.nan):
        with pytest.raises(UserInputError, match="latency"):
            SteppabilityConfig(rate=5.0, latency=latency)
