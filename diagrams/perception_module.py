"""From a depth image to planar regions: the wiring of the perception."""

from itertools import pairwise

from pydrake.systems.framework import Diagram, DiagramBuilder

from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.legged_egocan_system import LeggedEgocan
from quadpips_drake.perception.normal_estimator_system import NormalEstimator
from quadpips_drake.perception.region_extractor_system import RegionExtractor
from quadpips_drake.perception.superpixel_segmenter_system import SuperpixelSegmenter
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.sensing.camera_intrinsics import CameraIntrinsics
from quadpips_drake.sensing.depth_noise_system import DepthNoise
from quadpips_drake.sensing.self_filter_system import SelfFilter
from quadpips_drake.timing import StageTimings


def make_perception_module(
    robot: RobotModel,
    intrinsics: CameraIntrinsics,
    config: PerceptionConfig | None = None,
    timings: StageTimings | None = None,
    *,
    camera: str = "front",
    seed: int = 0,
) -> Diagram:
    """Returns the diagram "perception".

    (DepthNoise ->) (SelfFilter ->) NormalEstimator -> LeggedEgocan -> SuperpixelSegmenter -> RegionExtractor; the first two
    only as far as ``config`` enables them. If it enables the steppability, a SteppabilitySegmenter labels the same images.

    Args:
        robot: the one that carries the camera; with a changed camera pitch, the station's ``robot``.
        intrinsics: of the depth image.
        config: of all stages.
        timings: stopwatch for all stages.
        camera: name of the camera among the robot's mounts.
        seed: of the depth noise.

    Input ports:
        depth_image: ImageDepth32F of ``camera``, as the renderer made it.
        robot_state: abstract RobotState at the time of the image.
        labels (optional; not with the SteppabilitySegmenter): abstract LabelImage; without labels all ground is of UNKNOWN
            steppability and judged by geometry.

    Output ports: affordance_image, egocan, superpixels, region_set; of the types named like them.
    """
    config = config or PerceptionConfig()
    timings = timings or StageTimings()
    builder = DiagramBuilder()
    filters = _add_filters(builder, robot, intrinsics, config, timings, camera, seed)
    normals = builder.AddNamedSystem(
        "normal_estimator", NormalEstimator(robot.camera(camera).X_BC, intrinsics, config.normals, timings=timings)
    )
    egocan = builder.AddNamedSystem("legged_egocan", LeggedEgocan(robot, config.egocan, timings=timings))
    superpixels = builder.AddNamedSystem("superpixel_segmenter", SuperpixelSegmenter(config.superpixels, timings=timings))
    regions = builder.AddNamedSystem("region_extractor", RegionExtractor(robot.foot_radius, config.regions, timings=timings))

    builder.Connect(normals.GetOutputPort("affordance_image"), egocan.GetInputPort("affordance_image"))
    builder.Connect(egocan.GetOutputPort("egocan"), superpixels.GetInputPort("egocan"))
    builder.Connect(superpixels.GetOutputPort("superpixels"), regions.GetInputPort("superpixels"))

    chain = [*filters, normals]
    builder.ExportInput(chain[0].GetInputPort("depth_image"), "depth_image")
    for first, second in pairwise(chain):
        builder.Connect(first.GetOutputPort("depth_image"), second.GetInputPort("depth_image"))
    builder.ExportInput(egocan.GetInputPort("robot_state"), "robot_state")
    for system in chain:
        if system.HasInputPort("robot_state"):
            builder.ConnectInput("robot_state", system.GetInputPort("robot_state"))
    _connect_labels(builder, filters, normals, robot.camera(camera).X_BC, intrinsics, config, timings)
    outputs = ((normals, "affordance_image"), (egocan, "egocan"), (superpixels, "superpixels"), (regions, "region_set"))
    for system, port in outputs:
        builder.ExportOutput(system.GetOutputPort(port), port)
    diagram = builder.Build()
    diagram.set_name("perception")
    return diagram


def _connect_labels(builder, filters, normals, X_BC, intrinsics, config, timings) -> None:
    """Exports the input for labels, or adds the network, which labels the images that ``normals`` sees."""
    if not config.steppability.enabled:
        builder.ExportInput(normals.GetInputPort("labels"), "labels")
        return
    # Imported here, because torch takes its time.
    from quadpips_drake.learning.steppability_segmenter_system import SteppabilitySegmenter

    segmenter = SteppabilitySegmenter(X_BC, intrinsics, config.steppability, timings=timings)
    builder.AddNamedSystem("steppability_segmenter", segmenter)
    if filters:
        builder.Connect(filters[-1].GetOutputPort("depth_image"), segmenter.GetInputPort("depth_image"))
    else:
        builder.ConnectInput("depth_image", segmenter.GetInputPort("depth_image"))
    builder.ConnectInput("robot_state", segmenter.GetInputPort("robot_state"))
    builder.Connect(segmenter.GetOutputPort("labels"), normals.GetInputPort("labels"))


def _add_filters(builder, robot, intrinsics, config, timings, camera, seed) -> list:
    """Adds noise and self-filter, as far as they are enabled, and returns them in the order of the data flow."""
    filters = []
    if config.depth_noise.enabled:
        noise = DepthNoise(config.depth_noise, intrinsics=intrinsics, seed=seed, timings=timings)
        filters.append(builder.AddNamedSystem("depth_noise", noise))
    if config.self_filter.enabled:
        self_filter = SelfFilter(robot, config.self_filter, intrinsics=intrinsics, camera=camera, timings=timings)
        filters.append(builder.AddNamedSystem("self_filter", self_filter))
    return filters
