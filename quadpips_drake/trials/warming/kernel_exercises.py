"""A tiny piece of work for each group of stages, which compiles all of their kernels.

Numba compiles a kernel for the types of what it is called with. So each of these calls its stages as a diagram does, with
small inputs; afterwards a trial finds all kernels compiled (a test compares). They are independent of each other and import
what they need themselves, so that several processes can share them.
"""

import numpy as np

_UP = np.array([0.0, 0.0, 1.0])
_ROBOT = "anymal_c"


def optimal_control() -> None:
    """Swing optimisation over two steps, and the MPC along what comes out."""
    from quadpips_drake.control.mpc.real_time_iteration import MpcMemory, RealTimeIteration
    from quadpips_drake.robots.robot_library import load_robot
    from quadpips_drake.robots.standing import standing_state
    from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizer, known_ground
    from quadpips_drake.values.regions import GroundHeights

    robot = load_robot(_ROBOT)
    state = standing_state(robot)
    optimizer = SwingOptimizer(robot)
    x0 = optimizer.model.state_from_robot_state(state)
    plan = _two_steps(robot)
    ground = known_ground(plan, heights=GroundHeights(0.0, np.zeros(2), 0.01, np.zeros((50, 20), np.float32)))
    reference = optimizer.optimize(x0, plan, ground=ground).reference
    mpc, memory = RealTimeIteration(robot), MpcMemory.empty()
    for _ in range(2):
        memory = mpc.compute(state, reference, memory)
        memory.policy.swings[0][0].position(0.1)


def perception() -> None:
    """Labels by the network and both ways from depth images to regions, on a floor that ends."""
    from pydrake.common.value import AbstractValue, Value
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.sensors import ImageDepth32F

    from quadpips_drake.diagrams.elevation_module import ElevationModule
    from quadpips_drake.diagrams.perception_module import PerceptionModule
    from quadpips_drake.perception.config import steppable_perception
    from quadpips_drake.robots.robot_library import load_robot
    from quadpips_drake.robots.standing import standing_state
    from quadpips_drake.sensing.depth_camera import DepthCameraConfig, make_intrinsics

    robot, intrinsics = load_robot(_ROBOT), make_intrinsics(DepthCameraConfig())
    image = ImageDepth32F(intrinsics.width, intrinsics.height)
    X_WC = np.eye(4)
    X_WC[2, 3] = robot.nominal_base_height
    image.mutable_data[:, :, 0] = _depth_of_floor(X_WC @ robot.camera().X_BC, intrinsics)
    for module in (PerceptionModule(robot, intrinsics, steppable_perception()), ElevationModule(robot, intrinsics)):
        simulator = Simulator(module)
        context = simulator.get_mutable_context()
        module.GetInputPort("depth_image").FixValue(context, Value(image))
        for time in (0.0, 0.2, 0.4):  # labels appear after the first
            module.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(standing_state(robot, time)))
            simulator.AdvanceTo(time + 0.1)
            module.GetOutputPort("region_set").Eval(context)


def planning() -> None:
    """Torso and foothold search over a few regions of level ground."""
    from quadpips_drake.perception.regions.oracle_regions import OracleRegionConfig, nearby_regions, regions_from_terrain
    from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
    from quadpips_drake.planning.footholds.foothold_search import search_footholds
    from quadpips_drake.planning.torso.torso_config import TorsoConfig
    from quadpips_drake.planning.torso.torso_room import TorsoRoom
    from quadpips_drake.planning.torso.torso_search import search_torso_path
    from quadpips_drake.robots.robot_library import load_robot
    from quadpips_drake.robots.standing import standing_state
    from quadpips_drake.terrain.library import load_terrain
    from quadpips_drake.values.regions import GroundHeights, RegionSet

    robot = load_robot(_ROBOT)
    state = standing_state(robot)
    config = OracleRegionConfig(radius=1.5)
    everywhere = regions_from_terrain(load_terrain("flat"), robot.foot_radius, config)
    regions = RegionSet(0.0, nearby_regions(everywhere, state.p_WB, config.radius))
    known = GroundHeights(0.0, np.zeros(2), 0.1, np.zeros((5, 5), np.float32))
    path = search_torso_path(state.p_WB, 0.0, regions, np.array([0.6, 0.0]), robot, TorsoConfig(), heights=known)
    has_room = TorsoRoom(robot, known, clearance=TorsoConfig().belly_clearance)
    search_footholds(state, regions, path, robot, FootholdConfig(), has_room=has_room)
    search_torso_path(state.p_WB, 0.0, regions, np.array([9.0, 0.0]), robot, TorsoConfig())  # by way of a sub-goal
    _walk_by_heuristics(robot, state, regions)
    _search_commands(robot, state)


def _walk_by_heuristics(robot, state, regions) -> None:
    """One reference of a planner without a search, and what a network of footholds would see."""
    from quadpips_drake.baselines.learned_footholds.swing_view import patch_cell, swing_view
    from quadpips_drake.baselines.perceptive_walk import PerceptiveMemory, PerceptiveWalk
    from quadpips_drake.gaits.gaits import load_gait

    memory, command = PerceptiveMemory.empty(), np.array([0.2, 0.0, 0.0])
    memory = PerceptiveWalk(robot).update(memory, state, command, load_gait("trot"), regions)
    feet, nominal = memory.walk.touched.copy(), np.array(robot.nominal_footholds_B[:, :2])
    swing_view(feet, (0, 3), 0, feet[0, :2], nominal, patch_cell(robot), memory.ground.outlines)


def _search_commands(robot, state) -> None:
    """A few steps of a search over velocity commands, on level ground."""
    from quadpips_drake.baselines.motion_models.line_holding import Line
    from quadpips_drake.baselines.motion_models.planner.command_search import CommandSearch, CommandSearchConfig
    from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmapConfig, foot_costmap
    from quadpips_drake.baselines.motion_models.planner.variants import belief_of
    from quadpips_drake.baselines.motion_models.state import measured_step_state
    from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig
    from quadpips_drake.values.regions import GroundHeights

    belief = belief_of("ideal", robot, "trot", None, VelocityReferenceConfig(), None)
    search = CommandSearch(belief.models, CommandSearchConfig(horizon=2))
    level = foot_costmap(GroundHeights(0.0, np.full(2, -1.0), 0.1, np.zeros((20, 20), np.float32)), FootCostmapConfig())
    start = measured_step_state(state, robot.foot_positions_W(state), 0, None, np.zeros(3))
    question = start, np.zeros(4), 0.0, level, np.array([0.8, 0.0]), Line(np.zeros(2), 0.0)
    search.plan(*question, stamp=0.0, id=1)
    search.outcome(start, np.zeros(3))
    search.clearest(*question)


def whole_body_control() -> None:
    """Two ticks in the middle of a step."""
    from quadpips_drake.control.whole_body.task_space_inverse_dynamics import TaskSpaceInverseDynamics
    from quadpips_drake.math.constants import GRAVITY
    from quadpips_drake.robots.robot_library import load_robot
    from quadpips_drake.robots.standing import standing_state
    from quadpips_drake.trajectory.swing.swing_trajectory import SwingSpline
    from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE, CentroidalInput, CentroidalState
    from quadpips_drake.values.contact_schedule import ContactSchedule
    from quadpips_drake.values.mpc_policy import MpcPolicy
    from quadpips_drake.values.whole_body_command import WholeBodyCommand

    robot = load_robot(_ROBOT)
    state = standing_state(robot, 0.1)
    x, u = np.zeros(STATE_SIZE), np.zeros(INPUT_SIZE)
    x[CentroidalState.POSITION], x[CentroidalState.JOINTS] = state.p_WB, state.joint_positions
    u[CentroidalInput.VERTICAL_FORCES] = robot.mass * GRAVITY / 3.0
    foot = robot.foot_positions_W(state)[0]
    policy = MpcPolicy(
        stamp=0.1,
        times=np.array([0.0, 0.3]),
        states=np.stack((x, x)),
        inputs=u[None],
        base_twists=np.zeros((2, 6)),
        schedule=ContactSchedule(np.zeros(0), np.array([[False, True, True, True]])),
        swings=((SwingSpline(foot, foot + 0.1, 0.0, 0.3),), (), (), ()),
        normals=np.tile(_UP, (4, 1)),
        success=True,
    )
    control, command = TaskSpaceInverseDynamics(robot), WholeBodyCommand.empty()
    for _ in range(2):
        command = control.compute(state, policy, command)


def robot_and_ground() -> None:
    """How a robot stands on a terrain, the state that is estimated of it, and the noise of a depth camera in training."""
    from pydrake.common.value import AbstractValue

    from quadpips_drake.estimation.oracle_state_estimator_system import OracleStateEstimator
    from quadpips_drake.learning.depth_corruption import BINS, oil_paint
    from quadpips_drake.robots.robot_library import load_robot
    from quadpips_drake.terrain.library import load_terrain
    from quadpips_drake.terrain.standing_pose import standing_pose
    from quadpips_drake.terrain.truth import GroundTruth
    from quadpips_drake.values.sensing import FootContacts

    robot = load_robot(_ROBOT)
    p_WB, q = standing_pose(robot, GroundTruth(load_terrain("flat")), 0.0, 0.0, 0.0)
    estimator = OracleStateEstimator()
    context = estimator.CreateDefaultContext()
    estimator.GetInputPort("plant_state").FixValue(context, np.r_[1.0, 0.0, 0.0, 0.0, p_WB, q, np.zeros(18)])
    estimator.GetInputPort("joint_torques").FixValue(context, np.zeros(12))
    estimator.GetInputPort("foot_contacts").FixValue(context, AbstractValue.Make(FootContacts.empty()))
    robot.foot_positions_W(estimator.GetOutputPort("robot_state").Eval(context))
    image = np.ones((4, 4), np.float32)
    oil_paint(image, *np.nonzero(image), 1, BINS)


def _two_steps(robot):
    """A FootholdPlan of two small steps forward, over level ground that was seen."""
    from quadpips_drake.planning.start_stance import flat_region
    from quadpips_drake.values.legs import Leg
    from quadpips_drake.values.plans import FootholdPlan, Stance

    feet = robot.nominal_footholds_B * [1.0, 1.0, 0.0]
    stances, swings = [], ((Leg.LF, Leg.RH), (Leg.RF, Leg.LH))
    for step in range(3):
        for leg in swings[step - 1] if step else ():
            feet[leg, 0] += 0.05
        regions = tuple(flat_region(k, foot, 0.1, 0.1) for k, foot in enumerate(feet))
        base = np.array([0.025 * step, 0.0, robot.nominal_base_height])
        stances.append(Stance(feet.copy(), np.tile(_UP, (4, 1)), regions, base, np.zeros(3)))
    return FootholdPlan(0.0, 1, tuple(stances), swings, "standing_trot", swing_duration=0.3, stance_duration=0.1)


def _depth_of_floor(X_WC: np.ndarray, intrinsics) -> np.ndarray:
    """Depth image [m] of level ground at z = 0 that ends 1.2 m before the world's origin, seen from ``X_WC``."""
    v, u = np.mgrid[: intrinsics.height, : intrinsics.width]
    rays_C = np.stack(((u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy, np.ones(u.shape)), axis=-1)
    rays = rays_C @ X_WC[:3, :3].T
    with np.errstate(divide="ignore"):
        depth = -X_WC[2, 3] / rays[..., 2]
    seen = (depth > 0.0) & (X_WC[0, 3] + depth * rays[..., 0] < 1.2)
    return np.where(seen, depth, np.inf).astype(np.float32)
