"""From a depth image to planar regions: the wiring of the perception."""

from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.systems.framework import InputPort

from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.framework.systems import Diagram
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.legged_egocan_system import LeggedEgocan
from quadpips_drake.perception.normals.normal_estimator_system import NormalEstimator
from quadpips_drake.perception.regions.region_extractor_system import RegionExtractor
from quadpips_drake.perception.steppability.steppability_segmenter_system import SteppabilitySegmenter
from quadpips_drake.perception.superpixels.superpixel_segmenter_system import SuperpixelSegmenter
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.sensing.depth_noise_system import DepthNoise
from quadpips_drake.sensing.self_filter_system import SelfFilter
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.sensing import CameraIntrinsics

_SEEDS_APART = 1_000_003
"""Between the seeds of the cameras' noise."""


class PerceptionModule(Diagram):
    """From the depth images to planar regions.

    (DepthNoise ->) (SelfFilter ->) NormalEstimator -> LeggedEgocan -> SuperpixelSegmenter -> RegionExtractor; the first two
    only as far as the configuration enables them. If it enables the steppability, a SteppabilitySegmenter labels the same
    images. Each further camera has its own systems up to the egocan, which takes in all of them.

    .. pydrake_system::

        name: PerceptionModule
        input_ports:
        - robot_state
        - depth_image
        - labels (optional)
        - depth_image_<camera> (one for each of further_cameras)
        - labels_<camera> (optional)
        output_ports:
        - affordance_image
        - label_image (optional)
        - egocan
        - ground_heights
        - superpixels
        - region_set

    - robot_state: RobotState at the time of the images, frame W.
    - depth_image, and depth_image_<camera> for each further camera: ImageDepth32F, as the renderer made it [m].
    - labels, labels_<camera>: LabelImage; not there with the SteppabilitySegmenter. Without labels all ground is of UNKNOWN
      steppability and judged by geometry.
    - affordance_image: AffordanceImage of the first camera.
    - label_image: LabelImage, the newest of the first camera's SteppabilitySegmenter.
    - egocan: EgocanImage, frame E.
    - ground_heights: GroundHeights that the egocan remembers, frame W.
    - superpixels: SuperpixelImage, frame E.
    - region_set: RegionSet, frame W.
    """

    def __init__(
        self,
        robot: RobotModel,
        intrinsics: CameraIntrinsics,
        config: PerceptionConfig | None = None,
        timings: StageTimings | None = None,
        *,
        camera: str = "front",
        further_cameras: Sequence[str] = (),
        seed: int = 0,
        every_label: bool = False,
    ):
        """
        Args:
            robot: the one that carries the cameras; with a changed camera pitch, the station's ``robot``.
            intrinsics: of all depth images.
            config: of all stages.
            timings: stopwatch for all stages.
            camera: name of the first camera among the robot's mounts; the egocan stands there.
            further_cameras: names of all others.
            seed: of the depth noise, which differs from camera to camera.
            every_label: whether there are regions on what is not steppable, too.
        """
        super().__init__()
        config = config or PerceptionConfig()
        timings = timings or StageTimings()
        eyes = eyes_of((camera, *further_cameras), seed, intrinsics)
        self.optional_inputs = [f"labels{eye.suffix}" for eye in eyes]
        """Inputs that need nothing to feed them."""
        builder = DiagramBuilder()
        egocan = builder.AddSystem(LeggedEgocan(robot, config.egocan, further_cameras=further_cameras, timings=timings))
        superpixels = builder.AddSystem(SuperpixelSegmenter(config.superpixels, every_label=every_label, timings=timings))
        regions = builder.AddSystem(RegionExtractor(robot.foot_radius, config.regions, timings=timings))
        builder.ExportInput(egocan.GetInputPort("robot_state"), "robot_state")
        for eye in eyes:
            normals, segmenter = _add_eye(builder, robot, config, timings, eye)
            image = normals.GetOutputPort("affordance_image")
            builder.Connect(image, egocan.GetInputPort("affordance_image" + eye.suffix))
            if eye is eyes[0]:
                builder.ExportOutput(normals.GetOutputPort("affordance_image"), "affordance_image")
                if segmenter is not None:
                    builder.ExportOutput(segmenter.GetOutputPort("labels"), "label_image")
        builder.Connect(egocan.GetOutputPort("egocan"), superpixels.GetInputPort("egocan"))
        builder.Connect(superpixels.GetOutputPort("superpixels"), regions.GetInputPort("superpixels"))
        outputs = {"egocan": egocan, "ground_heights": egocan, "superpixels": superpixels, "region_set": regions}
        for port, system in outputs.items():
            builder.ExportOutput(system.GetOutputPort(port), port)
        builder.BuildInto(self)
        self.set_name("perception")


@dataclass(frozen=True)
class Eye:
    """One camera: its mount, what to append to its names, the seed of its noise."""

    camera: str
    suffix: str
    seed: int
    intrinsics: CameraIntrinsics


def eyes_of(cameras: Sequence[str], seed: int, intrinsics: CameraIntrinsics) -> list[Eye]:
    """Returns all ``cameras`` of a robot, the first of which needs no suffix; ``seed``: of its noise."""
    return [Eye(name, f"_{name}" if k else "", seed + k * _SEEDS_APART, intrinsics) for k, name in enumerate(cameras)]


def _add_eye(builder, robot, config, timings, eye: Eye) -> tuple[NormalEstimator, SteppabilitySegmenter | None]:
    """Adds all from the depth image of one camera to its affordance image; returns the last system and the network."""
    X_BC = robot.camera(eye.camera).X_BC
    normals = builder.AddSystem(
        NormalEstimator(X_BC, eye.intrinsics, config.normals, timings=timings, name="normal_estimator" + eye.suffix)
    )
    add_filters(builder, robot, config, timings, eye, normals.GetInputPort("depth_image"))
    builder.ConnectInput("robot_state", normals.GetInputPort("robot_state"))
    return normals, _connect_labels(builder, normals, config, timings, eye)


def _connect_labels(builder, normals, config, timings, eye: Eye) -> SteppabilitySegmenter | None:
    """Exports the input for labels, or adds the network, which labels the images that ``normals`` sees, and returns it."""
    if not config.steppability.enabled:
        builder.ExportInput(normals.GetInputPort("labels"), "labels" + eye.suffix)
        return None
    segmenter = SteppabilitySegmenter(
        eye.intrinsics, config.steppability, timings=timings, name="steppability_segmenter" + eye.suffix
    )
    builder.AddSystem(segmenter)
    builder.Connect(normals.GetOutputPort("affordance_image"), segmenter.GetInputPort("affordance_image"))
    builder.Connect(segmenter.GetOutputPort("labels"), normals.GetInputPort("labels"))
    return segmenter


def add_filters(builder, robot, config, timings, eye: Eye, consumer: InputPort) -> None:
    """Leads the exported depth image of ``eye`` to the ``consumer``, by way of noise and self-filter if they are enabled.

    The diagram's input ``robot_state`` must be there already.
    """
    chain = []
    if config.depth_noise.enabled:
        noise = DepthNoise(config.depth_noise, intrinsics=eye.intrinsics, seed=eye.seed, timings=timings)
        chain.append(builder.AddNamedSystem("depth_noise" + eye.suffix, noise))
    if config.self_filter.enabled:
        filter_ = SelfFilter(robot, config.self_filter, intrinsics=eye.intrinsics, camera=eye.camera, timings=timings)
        chain.append(builder.AddNamedSystem("self_filter" + eye.suffix, filter_))
        builder.ConnectInput("robot_state", filter_.GetInputPort("robot_state"))
    ports = [*(system.GetInputPort("depth_image") for system in chain), consumer]
    builder.ExportInput(ports[0], "depth_image" + eye.suffix)
    for system, port in zip(chain, ports[1:], strict=True):
        builder.Connect(system.GetOutputPort("depth_image"), port)
