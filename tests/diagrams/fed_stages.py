"""Every stage of the package with inputs that are new at every moment, so that each update gives another result."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.baselines.goal_command import GoalCommandConfig
from quadpips_drake.baselines.goal_command_system import GoalCommand
from quadpips_drake.baselines.motion_models.command_sequence_system import SequencedCommand
from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmap
from quadpips_drake.baselines.motion_models.planner.foot_costmap_system import FootCostmapBuilder, OracleFootCostmap
from quadpips_drake.baselines.motion_models.planner.velocity_planner_system import VelocityPlanner, VelocityPlannerConfig
from quadpips_drake.baselines.perceptive_config import PerceptiveReferenceConfig
from quadpips_drake.baselines.perceptive_reference_system import PerceptiveReference
from quadpips_drake.control.mpc.centroidal_mpc_system import CentroidalMpc
from quadpips_drake.control.mpc.mpc_config import MpcConfig
from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig
from quadpips_drake.control.references.velocity_reference_system import VelocityReference
from quadpips_drake.control.whole_body.whole_body_config import WbcConfig
from quadpips_drake.control.whole_body.whole_body_controller_system import WholeBodyController
from quadpips_drake.faults.failing_mpc_system import FailingMpc
from quadpips_drake.framework.stage import Stage
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.egocan import EgocanConfig
from quadpips_drake.perception.egocan.legged_egocan_system import LeggedEgocan
from quadpips_drake.perception.elevation.elevation_config import DistanceConfig, ElevationMapConfig, PlaneConfig
from quadpips_drake.perception.elevation.elevation_mapper_system import ElevationMapper
from quadpips_drake.perception.elevation.ground_distance_system import GroundDistance
from quadpips_drake.perception.elevation.plane_decomposer_system import PlaneDecomposer
from quadpips_drake.perception.normals.normal_estimator_system import NormalEstimator
from quadpips_drake.perception.normals.normals import NormalConfig
from quadpips_drake.perception.regions.oracle_regions import OracleRegionConfig
from quadpips_drake.perception.regions.oracle_regions_system import OracleRegions
from quadpips_drake.perception.regions.region_extraction import RegionConfig
from quadpips_drake.perception.regions.region_extractor_system import RegionExtractor
from quadpips_drake.perception.steppability.steppability_config import SteppabilityConfig
from quadpips_drake.perception.steppability.steppability_segmenter_system import SteppabilitySegmenter
from quadpips_drake.perception.superpixels.superpixel_segmenter_system import SuperpixelSegmenter
from quadpips_drake.perception.superpixels.superpixels import SuperpixelConfig
from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.experience.experience_recorder_system import ExperienceRecorder
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_planner_system import FootholdPlanner
from quadpips_drake.planning.torso.torso_config import TorsoConfig
from quadpips_drake.planning.torso.torso_planner_system import TorsoPlanner
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.supervision.reference_publisher import ReferencePublisherConfig
from quadpips_drake.supervision.reference_publisher_system import ReferencePublisher
from quadpips_drake.supervision.replan_monitor import MonitorConfig
from quadpips_drake.supervision.replan_monitor_system import ReplanMonitor
from quadpips_drake.supervision.safety import SafetyConfig
from quadpips_drake.supervision.safety_monitor_system import SafetyMonitor
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizerConfig
from quadpips_drake.trajectory.swing.swing_optimizer_system import SwingTrajectoryOptimizer
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.plans import FootholdPlan, PlanRequest, TorsoPath
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import ElevationMap, RegionSet
from quadpips_drake.values.swing_plan import SwingPlan
from tests.baselines import hand_made
from tests.perception import scenes
from tests.perception.elevation.maps import ideal_map
from tests.planning.worlds import standing_state
from tests.trajectory.walking import uneven_plan

ROBOT = load_robot("anymal_c")
X_BC = ROBOT.camera().X_BC
PERCEPTION = PerceptionConfig()
SEEN = scenes.look(scenes.Scene([]), [(0.0, scenes.base_pose(), 0.0)], PERCEPTION, scenes.SMALL)
"""What an egocan remembers of a floor."""
SEEN_MAP = ideal_map(scenes.Scene([]), half_extent=0.3)
EGOCAN, SUPERPIXELS, _ = scenes.regions_of(SEEN, PERCEPTION)


@dataclass(frozen=True)
class FedStage:
    """How to make a stage, and what to feed it."""

    config: type
    make: Callable
    """``make(config)`` returns the stage."""
    feed: Callable
    """``feed(k, time)`` returns the values at its inputs by name, other ones for each k."""


def _state(k, time):
    return {"robot_state": standing_state(ROBOT, stamp=time)}


def _with_state(**feeds):
    """A feed of the robot's state and of ``name=function(k, time)``."""
    return lambda k, time: _state(k, time) | {name: feed(k, time) for name, feed in feeds.items()}


def _nothing(kind):
    return lambda k, time: kind.empty()


def _image(intrinsics):
    image = ImageDepth32F(intrinsics.width, intrinsics.height)
    image.mutable_data[:, :, 0] = 1.0
    return lambda k, time: image


def _affordance(k, time):
    X_WC = scenes.base_pose() @ scenes.camera_mount()
    return scenes.affordance(scenes.Scene([]).depth(X_WC, scenes.SMALL), X_WC, time, PERCEPTION, scenes.SMALL)


_no_reference = {"reference": _nothing(WholeBodyReference)}
_mpc_feed = _with_state(**_no_reference)
_one_swing = uneven_plan(ROBOT, swings=1)


def _ahead(k, time):
    return np.array([2.0, 0.0])


FIXED = {SequencedCommand, FootCostmapBuilder, OracleFootCostmap}
"""Stages without a section of the configuration: their rate is no setting, and they are never late."""

STAGES = {
    TorsoPlanner: FedStage(
        TorsoConfig,
        lambda config: TorsoPlanner(ROBOT, config),
        _with_state(
            region_set=lambda k, time: RegionSet(time, ()),
            plan_request=lambda k, time: PlanRequest(k + 1, time, np.array([2.0, 0.0])),
        ),
    ),
    FootholdPlanner: FedStage(
        FootholdConfig,
        lambda config: FootholdPlanner(ROBOT, config),
        _with_state(torso_path=lambda k, time: replace(TorsoPath.empty(), stamp=time, request_id=k + 1)),
    ),
    SwingTrajectoryOptimizer: FedStage(
        SwingOptimizerConfig,
        lambda config: SwingTrajectoryOptimizer(ROBOT, config),
        _with_state(foothold_plan=lambda k, time: replace(_one_swing, request_id=k + 1)),
    ),
    ReferencePublisher: FedStage(
        ReferencePublisherConfig,
        ReferencePublisher,
        lambda k, time: {
            "planned_reference": replace(
                WholeBodyReference.empty(),
                request_id=k + 1,
                times=np.array([0.0, 1.0]),
                states=np.zeros((2, 24)),
                inputs=np.zeros((2, 24)),
            )
        },
    ),
    ReplanMonitor: FedStage(
        MonitorConfig,
        lambda config: ReplanMonitor(ROBOT, config),
        _with_state(**_no_reference, foothold_plan=_nothing(FootholdPlan), goal=lambda k, time: np.array([2.0, 0.0])),
    ),
    SafetyMonitor: FedStage(
        SafetyConfig,
        lambda config: SafetyMonitor(ROBOT, config),
        _with_state(**_no_reference, mpc_policy=_nothing(MpcPolicy)),
    ),
    CentroidalMpc: FedStage(MpcConfig, lambda config: CentroidalMpc(ROBOT, config), _mpc_feed),
    FailingMpc: FedStage(MpcConfig, lambda config: FailingMpc(ROBOT, config), _mpc_feed),
    WholeBodyController: FedStage(
        WbcConfig, lambda config: WholeBodyController(ROBOT, config), _with_state(mpc_policy=_nothing(MpcPolicy))
    ),
    VelocityReference: FedStage(
        VelocityReferenceConfig,
        lambda config: VelocityReference(ROBOT, config),
        _with_state(velocity_command=lambda k, time: np.array([0.3, 0.0, 0.0]), gait=lambda k, time: "trot"),
    ),
    NormalEstimator: FedStage(
        NormalConfig,
        lambda config: NormalEstimator(X_BC, scenes.SMALL, config),
        _with_state(depth_image=_image(scenes.SMALL)),
    ),
    SteppabilitySegmenter: FedStage(
        SteppabilityConfig,
        lambda config: SteppabilitySegmenter(scenes.SMALL, config),
        lambda k, time: {"affordance_image": _affordance(k, time)},
    ),
    LeggedEgocan: FedStage(
        EgocanConfig, lambda config: LeggedEgocan(ROBOT, config), _with_state(affordance_image=_affordance)
    ),
    SuperpixelSegmenter: FedStage(
        SuperpixelConfig, SuperpixelSegmenter, lambda k, time: {"egocan": replace(EGOCAN, stamp=time)}
    ),
    RegionExtractor: FedStage(
        RegionConfig,
        lambda config: RegionExtractor(ROBOT.foot_radius, config),
        lambda k, time: {"superpixels": replace(SUPERPIXELS, stamp=time)},
    ),
    ElevationMapper: FedStage(
        ElevationMapConfig,
        lambda config: ElevationMapper(ROBOT, scenes.SMALL, config),
        _with_state(depth_image=_image(scenes.SMALL)),
    ),
    PlaneDecomposer: FedStage(
        PlaneConfig,
        lambda config: PlaneDecomposer(ROBOT.foot_radius, config),
        lambda k, time: {"elevation_map": replace(ElevationMap.empty(), stamp=time)},
    ),
    GoalCommand: FedStage(GoalCommandConfig, GoalCommand, _with_state(goal=_ahead)),
    PerceptiveReference: FedStage(
        PerceptiveReferenceConfig,
        lambda config: PerceptiveReference(ROBOT, config),
        _with_state(
            velocity_command=lambda k, time: np.array([0.3, 0.0, 0.0]),
            gait=lambda k, time: "trot",
            region_set=lambda k, time: replace(hand_made.floor(), stamp=time),
        ),
    ),
    VelocityPlanner: FedStage(
        VelocityPlannerConfig,
        lambda config: VelocityPlanner(ROBOT, "trot", None, config),
        _with_state(goal=_ahead, foot_costmap=_nothing(FootCostmap)),
    ),
    ExperienceRecorder: FedStage(
        ExperienceConfig,
        ExperienceRecorder,
        lambda k, time: {
            "foothold_plan": replace(_one_swing, request_id=k + 1),
            "swing_plan": SwingPlan.without_motion(time, k + 1),
        },
    ),
    GroundDistance: FedStage(
        DistanceConfig, GroundDistance, lambda k, time: {"elevation_map": replace(SEEN_MAP, stamp=time)}
    ),
    OracleRegions: FedStage(
        OracleRegionConfig, lambda config: OracleRegions(load_terrain("flat"), ROBOT.foot_radius, config), _state
    ),
}
"""By class."""


def outputs_over_time(cls: type[Stage], step: float, samples: int, **settings) -> dict[str, list]:
    """What can be told apart of each output of the stage ``cls`` in the middle of each of ``samples`` steps [s].

    Args:
        cls: one of STAGES.
        step: how often the inputs change [s].
        samples: number of steps.
        settings: of the stage's configuration, beside the defaults.
    """
    fed = STAGES[cls]
    stage = fed.make(fed.config(**settings))
    simulator = Simulator(stage)
    context = simulator.get_mutable_context()
    ports = [stage.get_output_port(i) for i in range(stage.num_output_ports())]
    seen = {port.get_name(): [] for port in ports}
    for k in range(samples):
        for name, value in fed.feed(k, k * step).items():
            _fix(stage.GetInputPort(name), context, value)
        simulator.AdvanceTo((k + 0.5) * step)
        for port in ports:
            seen[port.get_name()].append(_signature(port.Eval(context)))
    return seen


def _fix(port, context, value) -> None:
    if isinstance(value, np.ndarray):
        port.FixValue(context, value)
    else:
        port.FixValue(context, Value(value) if isinstance(value, ImageDepth32F) else AbstractValue.Make(value))


def _signature(value):
    """Of a value, what changes with each update: times and numbers of requests, but not how long something took."""
    if isinstance(value, np.ndarray):
        return value.tobytes()
    value = getattr(value, "reference", value)
    parts = tuple(getattr(value, name) for name in ("stamp", "request_id", "id", "trials") if hasattr(value, name))
    return parts or value
