"""From depth images by way of an elevation map to planar regions: the wiring."""

from collections.abc import Sequence

from quadpips_drake.diagrams.perception_module import add_filters, eyes_of
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.framework.systems import Diagram
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.elevation.elevation_config import ElevationConfig
from quadpips_drake.perception.elevation.elevation_mapper_system import ElevationMapper
from quadpips_drake.perception.elevation.ground_distance_system import GroundDistance
from quadpips_drake.perception.elevation.plane_decomposer_system import PlaneDecomposer
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.sensing import CameraIntrinsics


class ElevationModule(Diagram):
    """From the depth images to planar regions, by way of an elevation map instead of superpixels.

    (DepthNoise ->) (SelfFilter ->) ElevationMapper -> PlaneDecomposer; the first two are those of the PerceptionModule, so
    that both see the same images. With a distance, GroundDistance stands beside the PlaneDecomposer.

    .. pydrake_system::

        name: ElevationModule
        input_ports:
        - robot_state
        - depth_image
        - depth_image_<camera> (one for each of further_cameras)
        output_ports:
        - elevation_map
        - ground_heights
        - region_set
        - signed_distance (optional)

    - robot_state: RobotState at the time of the images, frame W.
    - depth_image, and depth_image_<camera> for each further camera: ImageDepth32F, as the renderer made it [m].
    - elevation_map: ElevationMap, frame W.
    - ground_heights: GroundHeights of the map, frame W.
    - region_set: RegionSet, frame W.
    - signed_distance: SignedDistance from the ground, frame W; only ``with_distance``.
    """

    def __init__(
        self,
        robot: RobotModel,
        intrinsics: CameraIntrinsics,
        config: ElevationConfig | None = None,
        timings: StageTimings | None = None,
        *,
        images: PerceptionConfig | None = None,
        camera: str = "front",
        further_cameras: Sequence[str] = (),
        seed: int = 0,
        with_distance: bool = False,
    ):
        """
        Args:
            robot: the one that carries the cameras; with a changed camera pitch, the station's ``robot``.
            intrinsics: of all depth images.
            config: of map and planes.
            timings: stopwatch for all stages.
            images: whose depth noise and self-filter the images go through.
            camera: name of the first camera among the robot's mounts.
            further_cameras: names of all others.
            seed: of the depth noise, which differs from camera to camera.
            with_distance: whether the signed distance from the ground is worked out, too.
        """
        super().__init__()
        config, images = config or ElevationConfig(), images or PerceptionConfig()
        timings = timings or StageTimings()
        builder = DiagramBuilder()
        shared = {"preset": config.preset, "timings": timings}
        cameras = {"camera": camera, "further_cameras": further_cameras}
        mapper = builder.AddSystem(ElevationMapper(robot, intrinsics, config.map, **cameras, **shared))
        planes = builder.AddSystem(PlaneDecomposer(robot.foot_radius, config.planes, **shared))
        builder.ExportInput(mapper.GetInputPort("robot_state"), "robot_state")
        for eye in eyes_of((camera, *further_cameras), seed, intrinsics):
            port = "depth_image" + eye.suffix
            add_filters(builder, robot, images, timings, eye, mapper.GetInputPort(port))
        builder.Connect(mapper.GetOutputPort("elevation_map"), planes.GetInputPort("elevation_map"))
        for port in ("elevation_map", "ground_heights"):
            builder.ExportOutput(mapper.GetOutputPort(port), port)
        builder.ExportOutput(planes.GetOutputPort("region_set"), "region_set")
        if with_distance:
            distance = builder.AddSystem(GroundDistance(config.distance, timings=timings))
            builder.Connect(mapper.GetOutputPort("elevation_map"), distance.GetInputPort("elevation_map"))
            builder.ExportOutput(distance.GetOutputPort("signed_distance"), "signed_distance")
        builder.BuildInto(self)
        self.set_name("elevation")
