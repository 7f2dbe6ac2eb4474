"""Spoiled images, poses, cans and labels through every system from the camera to the regions.

Nothing raises, and nothing leaves a system but what may be stepped on.
"""

import dataclasses

import numpy as np
import pytest
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.diagrams.perception_module import PerceptionModule
from quadpips_drake.math.polygons import area_and_centroid
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.egocan import EgocanConfig, draw_egocan
from quadpips_drake.perception.egocan.ground_memory import GroundMemoryConfig
from quadpips_drake.perception.normals.normal_estimator_system import NormalEstimator
from quadpips_drake.perception.regions.region_extractor_system import RegionExtractor
from quadpips_drake.perception.superpixels.superpixel_segmenter_system import SuperpixelSegmenter
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.sensing.depth_noise import DepthNoiseConfig
from quadpips_drake.sensing.depth_noise_system import DepthNoise
from quadpips_drake.sensing.self_filter import SelfFilterConfig
from quadpips_drake.sensing.self_filter_system import SelfFilter
from quadpips_drake.values.images import EgocanImage, LabelImage
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.steppability import Steppability
from tests.perception.scenes import FOOT_RADIUS, SMALL, Scene, base_pose, look

ROBOT = load_robot("anymal_c")
NOTHING_ASSUMED = GroundMemoryConfig(assumed_behind=0.0, assumed_ahead=0.0, assumed_half_width=0.0)
CONFIG = PerceptionConfig(
    depth_noise=DepthNoiseConfig(sigma=0.001, sigma_growth=0.004, dropout=0.02), egocan=EgocanConfig(ground=NOTHING_ASSUMED)
)
SHAPE = (SMALL.height, SMALL.width)


def state_at(k=0, **changes):
    X_WB = base_pose(x=0.02 * k, height=ROBOT.nominal_base_height)
    state = dataclasses.replace(
        RobotState.empty(), stamp=k / 30.0, p_WB=X_WB[:3, 3], joint_positions=np.array(ROBOT.nominal_joints)
    )
    return dataclasses.replace(state, **changes)


def floor(state):
    X_WB = np.eye(4)
    X_WB[:3, :3], X_WB[:3, 3] = state.R_WB, state.p_WB
    return Scene([]).depth(X_WB @ ROBOT.camera().X_BC, SMALL)


def image_of(depth):
    image = ImageDepth32F(depth.shape[1], depth.shape[0]) if depth.size else ImageDepth32F()
    if depth.size:
        image.mutable_data[:, :, 0] = depth
    return image


def noise_of_any_size():
    return np.random.default_rng(0).uniform(-1.0, 9.0, SHAPE)


BAD_IMAGES = {
    "nan": np.full(SHAPE, np.nan),
    "inf": np.full(SHAPE, np.inf),
    "minus inf": np.full(SHAPE, -np.inf),
    "zero": np.zeros(SHAPE),
    "negative": np.full(SHAPE, -1.0),
    "saturated": np.full(SHAPE, 65.535),
    "huge": np.full(SHAPE, 1e38),
    "too near": np.full(SHAPE, 1e-30),
    "empty": np.zeros((0, 0)),
    "one pixel": np.ones((1, 1)),
    "transposed": np.ones(SHAPE[::-1]),
    "larger": np.ones((2 * SHAPE[0], 2 * SHAPE[1])),
}
BAD_STATES = {
    "position nan": {"p_WB": np.full(3, np.nan)},
    "position inf": {"p_WB": np.array([np.inf, 0.0, 0.5])},
    "rotation nan": {"R_WB": np.full((3, 3), np.nan)},
    "yaw nan": {"rpy_WB": np.array([0.0, 0.0, np.nan])},
    "joints nan": {"joint_positions": np.full(12, np.nan)},
    "joints inf": {"joint_positions": np.full(12, np.inf)},
    "stamp nan": {"stamp": np.nan},
}


def area(regions):
    """Area of all insets [m^2]."""
    return sum(area_and_centroid(np.ascontiguousarray(region.inset))[0] for region in regions)


class FedModule:
    """A perception module, fed frame by frame."""

    def __init__(self, module, period: float, outputs: tuple[str, ...]):
        """``period``: long enough for the slowest stage to take in a frame [s]; ``outputs``: read beside the regions."""
        self.module, self._period, self._outputs = module, period, outputs
        self.simulator, self.frames = Simulator(module), 0

    def show(self, depth, state):
        """Feeds one frame and returns the regions that perception then knows."""
        context = self.simulator.get_mutable_context()
        self.module.GetInputPort("depth_image").FixValue(context, Value(image_of(depth)))
        self.module.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(state))
        if self.frames == 0:
            self.simulator.Initialize()
        self.frames += 1
        self.simulator.AdvanceTo(self.frames * self._period)
        for name in self._outputs:
            self.module.GetOutputPort(name).Eval(context)
        return self.module.GetOutputPort("region_set").Eval(context).regions


class Perception(FedModule):
    """Of superpixels."""

    def __init__(self):
        super().__init__(PerceptionModule(ROBOT, SMALL, CONFIG), 0.1, ("affordance_image", "egocan", "superpixels"))


@pytest.mark.parametrize("name", BAD_IMAGES)
def test_a_bad_image_raises_nothing_and_makes_no_region(name):
    perception = Perception()
    assert perception.show(BAD_IMAGES[name], state_at()) == ()
    before = perception.show(floor(state_at(1)), state_at(1))
    assert len(before) > 10, "it recovers"
    after = perception.show(BAD_IMAGES[name], state_at(2))
    # Superpixels go on settling on the ground that is known; nothing must come to it that a good image would not show.
    twin = Perception()
    for state in (state_at(0), state_at(1), state_at(2)):
        good = twin.show(floor(state), state)
    assert area(after) <= 1.05 * area(good) and all(abs(region.center[2]) < 0.02 for region in after), "invents nothing"
    assert len(perception.show(floor(state_at(3)), state_at(3))) > 10


@pytest.mark.parametrize("name", BAD_STATES)
def test_a_bad_state_raises_nothing_and_makes_no_region(name):
    perception, spoiled = Perception(), state_at(**BAD_STATES[name])
    first = perception.show(floor(state_at()), spoiled)
    assert first == () or name.startswith("joints")
    before = perception.show(floor(state_at(1)), state_at(1))
    assert len(before) > 10
    after = perception.show(floor(state_at(2)), state_at(2, **BAD_STATES[name]))
    assert all(abs(region.center[2]) < 0.02 for region in after)


@pytest.mark.parametrize("jump", [(0.8, 0.0, 0.0), (0.0, 0.0, 3.0), (1e7, -1e7, 0.0)])
def test_a_pose_that_jumps_starts_a_new_memory(jump):
    perception = Perception()
    assert len(perception.show(floor(state_at()), state_at())) > 10
    state = state_at(1)
    state = dataclasses.replace(state, p_WB=state.p_WB + jump)
    # Level ground as seen from the nominal height lies where the robot now seems to be.
    regions = perception.show(floor(state_at(1)), state)
    assert len(regions) > 10
    for region in regions:
        assert np.hypot(*(region.center[:2] - state.p_WB[:2])) < 2.5, "nothing from before is kept"
        assert abs(region.center[2] - jump[2]) < 0.02


def evaluate(system, port, inputs):
    context = system.CreateDefaultContext()
    for name, value in inputs.items():
        system.GetInputPort(name).FixValue(context, value)
    return system.GetOutputPort(port).Eval(context)


@pytest.mark.parametrize("name", BAD_IMAGES)
def test_noise_and_self_filter_hand_bad_images_on(name):
    image, state = Value(image_of(BAD_IMAGES[name])), AbstractValue.Make(state_at())
    noisy = evaluate(DepthNoise(CONFIG.depth_noise, intrinsics=SMALL), "depth_image", {"depth_image": image})
    self_filter = SelfFilter(ROBOT, SelfFilterConfig(), intrinsics=SMALL)
    filtered = evaluate(self_filter, "depth_image", {"depth_image": image, "robot_state": state})
    for result in (noisy, filtered):
        usable = (result.data > 0.1) & (result.data < 3.0)
        assert not usable.any() or BAD_IMAGES[name].shape != SHAPE


@pytest.mark.parametrize("labels", [LabelImage.empty(), LabelImage(np.nan, np.full(SHAPE, 250, np.uint8))])
def test_labels_that_are_none_do_no_harm(labels):
    inputs = {"depth_image": Value(image_of(noise_of_any_size())), "robot_state": AbstractValue.Make(state_at())}
    inputs["labels"] = AbstractValue.Make(labels)
    image = evaluate(NormalEstimator(ROBOT.camera().X_BC, SMALL), "affordance_image", inputs)
    assert image.labels.shape == SHAPE


# From here on: nonsense in the cap of the egocan, to superpixels and regions as they are wired.

PLAIN = PerceptionConfig()
RNG = np.random.default_rng(5)


@pytest.fixture(scope="module")
def good():
    return draw_egocan(look(Scene([]), [(0.0, base_pose(), 0.0)], PLAIN), PLAIN.egocan)


def with_height(can, height):
    return dataclasses.replace(can, cap_height=np.asarray(height, np.float32))


def in_shape(can, rows, columns):
    """``can`` cut or repeated to another size, as a wrong configuration would give it."""
    cut = {name: np.resize(getattr(can, name), (rows, columns, *getattr(can, name).shape[2:])) for name in CAP}
    return dataclasses.replace(can, **cut)


CAP = ("cap_height", "cap_normals", "cap_labels")

NONSENSE = {
    "empty": lambda can: EgocanImage.empty(),
    "nan": lambda can: with_height(can, np.full_like(can.cap_height, np.nan)),
    "zero": lambda can: with_height(can, np.zeros_like(can.cap_height)),
    "saturated": lambda can: with_height(can, np.full_like(can.cap_height, 65.535)),
    "infinite": lambda can: with_height(can, np.full_like(can.cap_height, np.inf)),
    "negative": lambda can: with_height(can, -can.cap_height),
    "noise": lambda can: with_height(can, RNG.uniform(0.0, 1.0, can.cap_height.shape)),
    "no normals": lambda can: dataclasses.replace(can, cap_normals=np.full_like(can.cap_normals, np.nan)),
    "zero normals": lambda can: dataclasses.replace(can, cap_normals=np.zeros_like(can.cap_normals)),
    "random normals": lambda can: dataclasses.replace(
        with_height(can, RNG.uniform(0.3, 0.7, can.cap_height.shape)),
        cap_normals=RNG.normal(size=can.cap_normals.shape).astype(np.float32),
    ),
    "normals of another size": lambda can: dataclasses.replace(can, cap_normals=can.cap_normals[:100]),
    "labels of another size": lambda can: dataclasses.replace(can, cap_labels=can.cap_labels[:, :7]),
    "nan pose": lambda can: dataclasses.replace(can, X_WE=np.full((4, 4), np.nan)),
    "one pixel": lambda can: in_shape(can, 1, 1),
    "one row": lambda can: with_height(in_shape(can, 1, 300), np.full((1, 300), 0.5)),
}


def perceive(cans):
    """Returns the region sets after each of ``cans``, through the two systems as they are wired."""
    builder = DiagramBuilder()
    segmenter = builder.AddSystem(SuperpixelSegmenter(PLAIN.superpixels))
    extractor = builder.AddSystem(RegionExtractor(FOOT_RADIUS, PLAIN.regions))
    builder.Connect(segmenter.GetOutputPort("superpixels"), extractor.GetInputPort("superpixels"))
    builder.ExportInput(segmenter.GetInputPort("egocan"), "egocan")
    builder.ExportOutput(extractor.GetOutputPort("region_set"), "region_set")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    results = []
    for k, can in enumerate(cans):
        can = dataclasses.replace(can, stamp=0.05 * k) if np.isfinite(can.stamp) else can
        diagram.GetInputPort("egocan").FixValue(simulator.get_mutable_context(), AbstractValue.Make(can))
        simulator.AdvanceTo((k + 0.5) / PLAIN.superpixels.rate)
        results.append(diagram.GetOutputPort("region_set").Eval(simulator.get_context()))
    return results


@pytest.mark.parametrize("name", NONSENSE)
def test_nonsense_makes_no_region_and_is_forgotten(good, name):
    """At the start and in mid-walk; once it is over, there is ground again, and no id is given twice."""
    bad = NONSENSE[name](good)
    first, before, during, after = perceive([bad, good, bad, good])
    assert first.regions == () and during.regions == ()
    assert len(before.regions) > 30 and len(after.regions) > 30
    ids = [region.id for region in before.regions]
    if name == "empty":
        assert not set(ids) & {region.id for region in after.regions}


def test_a_jump_of_the_pose_starts_afresh(good):
    X_WE = np.array(good.X_WE)
    X_WE[:3, 3] += [30.0, -2.0, 0.0]
    before, jumped = perceive([good, dataclasses.replace(good, X_WE=X_WE)])
    assert len(jumped.regions) == len(before.regions)
    assert not {region.id for region in before.regions} & {region.id for region in jumped.regions}
    assert all(region.center[0] > 20.0 for region in jumped.regions)


@pytest.mark.parametrize("label", list(Steppability))
def test_labels_decide_and_reach_the_regions(good, label):
    """Ground that is not steppable leaves the health check; steppable and unknown ground keeps its label (V-D.1)."""
    labels = np.zeros_like(good.cap_labels)
    labels[128:] = label
    (result,) = perceive([dataclasses.replace(good, cap_labels=labels)])
    ahead = [region for region in result.regions if region.center[0] > good.X_WE[0, 3] + 0.15]
    behind = [region for region in result.regions if region.center[0] < good.X_WE[0, 3] - 0.15]
    assert behind and all(region.label == Steppability.UNKNOWN for region in behind)
    if label in (Steppability.UNKNOWN, Steppability.STEPPABLE):
        assert len(ahead) > 10 and all(region.label == label for region in ahead)
    else:
        assert not ahead
        reach = max((region.boundary @ region.X_WR[:2, :2].T + region.center[:2])[:, 0].max() for region in behind)
        assert reach < good.X_WE[0, 3] + 0.01


def test_a_label_that_does_not_exist_is_not_stepped_on(good):
    (result,) = perceive([dataclasses.replace(good, cap_labels=np.full_like(good.cap_labels, 200))])
    assert result.regions == ()
