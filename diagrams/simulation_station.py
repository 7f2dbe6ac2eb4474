"""The simulation station: a robot on a terrain, with its drives and sensors, behind ports that a real one could have."""

from dataclasses import dataclass, field, replace

import numpy as np
from pydrake.geometry import GeometryId, MeshcatVisualizer, RoleAssign, SceneGraph
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    CoulombFriction,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.framework import Diagram
from pydrake.systems.primitives import DiscreteTimeDelay
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from quadpips_drake.errors import UserInputError
from quadpips_drake.estimation.oracle_state_estimator_system import OracleStateEstimator
from quadpips_drake.faults.model_errors import ModelErrorConfig, add_payload, set_base_mass
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.sensing.contact_sensing import find_contact_geometries, touching_links
from quadpips_drake.sensing.depth_camera import DepthCameraConfig, add_depth_camera, make_intrinsics
from quadpips_drake.sensing.imu_system import Imu, ImuConfig
from quadpips_drake.terrain.plant_builder import add_terrain_to_plant
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.legs import JOINTS_PER_LEG, NUM_JOINTS, Leg


@dataclass
class StationConfig:
    """Physics, drives and sensors of the simulation."""

    time_step: float = 0.001
    """Step of the physics [s]."""
    contact_approximation: str = "sap"
    """Drake's contact solver: sap, similar or lagged (tamsi knows no joint PD)."""
    stiffness: list[float] | None = None
    """Proportional gains of the drives for HAA, HFE, KFE [N m/rad]; null: the robot's."""
    damping: list[float] | None = None
    """Derivative gains of the drives for HAA, HFE, KFE [N m s/rad]; null: the robot's."""
    contact_threshold: float = 5.0
    """Force from which on a foot is reported to be in contact [N]."""
    camera_name: str = "front"
    """Which of the robot's cameras is the depth camera, at which perception's egocan stands."""
    further_cameras: list[str] = field(default_factory=list)
    """Which others look around as well, for example [left, right, rear]; each costs its rendering, normals and egocan."""
    camera_pitch: float | None = None
    """Viewing direction of that camera below the horizon [rad]; null: the robot's."""
    camera: DepthCameraConfig = field(default_factory=DepthCameraConfig)
    imu: ImuConfig = field(default_factory=ImuConfig)
    model_error: ModelErrorConfig = field(default_factory=ModelErrorConfig)
    seed: int = 0
    """Seed of the sensors' noise."""

    def __post_init__(self):
        if not 1e-5 <= self.time_step <= 0.01:
            raise UserInputError(f"station: time_step must be 1e-5..0.01 s, got {self.time_step}")
        if self.contact_approximation not in ("sap", "similar", "lagged"):
            raise UserInputError(
                f"station: contact_approximation must be sap, similar or lagged, got '{self.contact_approximation}'"
            )
        if len({self.camera_name, *self.further_cameras}) != 1 + len(self.further_cameras):
            raise UserInputError(f"station: further_cameras must name other cameras than '{self.camera_name}', each once")
        for name in ("stiffness", "damping"):
            gains = getattr(self, name)
            if gains is not None and (len(gains) != JOINTS_PER_LEG or min(gains) < 0):
                raise UserInputError(f"station: {name} needs three values (HAA, HFE, KFE), none negative, got {gains}")


class SimulationStation(Diagram):
    """A robot on a terrain, simulated: MultibodyPlant and SceneGraph, drives with joint PD, depth camera, IMU.

    The drives apply u = clamp(feedforward_torque + K (q_d - q) + D (v_d - v), effort limits), the PD part implicitly within
    the plant's step, so that high gains stay stable. While ``desired_joint_state`` is not connected there is no PD.

    .. pydrake_system::

        name: SimulationStation
        input_ports:
        - feedforward_torque (optional)
        - desired_joint_state (optional)
        - applied_spatial_force (optional)
        output_ports:
        - depth_image
        - camera_pose
        - depth_image_<camera> (one for each of further_cameras)
        - camera_pose_<camera> (one for each of further_cameras)
        - robot_state
        - imu
        - plant_state
        - joint_torques
        - contact_results
        - query_object

    - feedforward_torque: [N m], vector (12,).
    - desired_joint_state: joint positions [rad] and velocities [rad/s], vector (24,).
    - applied_spatial_force: list of pydrake ExternallyAppliedSpatialForce, frame W: pushes.
    - depth_image: ImageDepth32F (width, height) [m], along the optical axis; 0 too near, inf too far or nothing there. It is
      rendered when it is read, without delay: whoever samples it sets the rate (``camera_period``).
    - camera_pose: RigidTransform X_WC of the optical frame (x right, y down, z forward).
    - depth_image_<camera>, camera_pose_<camera>: the same of the further cameras.
    - joint_torques: what the drives applied in the last step, after clamping [N m], vector (12,).
    - imu: angular velocity [rad/s], specific force [m/s^2] in the base's axes, vector (6,).

    Oracle ports, which no real robot has:

    - plant_state: positions and velocities of the plant, vector (37,).
    - robot_state: RobotState without error, from OracleStateEstimator.
    - contact_results: ContactResults of the last step.
    - query_object: SceneGraph's QueryObject.
    """

    def __init__(self, robot: RobotModel, terrain: Terrain, config: StationConfig, meshcat=None):
        Diagram.__init__(self)
        if config.camera_pitch is not None:
            robot = robot.with_camera_pitch(config.camera_name, config.camera_pitch)
        self.robot = robot
        """The RobotModel, with the camera as configured."""
        self.terrain = terrain
        self.config = config
        self.camera_intrinsics = make_intrinsics(config.camera)
        self.camera_period = 1.0 / config.camera.rate
        """Time between frames [s]."""
        self._truth = GroundTruth(terrain)
        self._delays: dict[str, DiscreteTimeDelay] = {}

        builder = DiagramBuilder()
        self.plant, self.scene_graph = _add_plant(builder, robot, terrain, config)
        self.contact_geometries = find_contact_geometries(robot, self.plant, self.scene_graph.model_inspector())
        self._camera_plant = self._add_camera(builder)
        self._add_sensors(builder)
        self._export_plant_ports(builder)
        if meshcat is not None:
            MeshcatVisualizer.AddToBuilder(builder, self.scene_graph, meshcat)
        builder.BuildInto(self)
        self.set_name("station")

    def set_initial_state(self, root_context, x: float, y: float, yaw: float) -> None:
        """Stands the robot on the terrain, at rest: torso level above (x, y) [m], turned by ``yaw`` [rad].

        Each foot rests on the ground below its nominal place, by inverse kinematics.

        Raises:
            UserInputError: a foot would find no ground, or cannot reach it.
        """
        p_WB, q = standing_pose(self.robot, self._truth, x, y, yaw)
        plant_context = self.plant.GetMyMutableContextFromRoot(root_context)
        self.robot.set_state(self.plant, plant_context, p_WB, [0.0, 0.0, yaw], q)
        set_base_mass(self.plant, plant_context, self.robot, self.config.model_error)
        if self._delays:
            # What the drives got before the first command arrives: hold the stance.
            for name, before in (("feedforward_torque", np.zeros(NUM_JOINTS)), ("desired_joint_state", np.r_[q, 0.0 * q])):
                state = self._delays[name].GetMyMutableContextFromRoot(root_context).get_mutable_discrete_state_vector()
                state.SetFromVector(np.resize(before, state.size()))

    def touching_links(self, root_context) -> list[str]:
        """Returns the robot's links that touch the terrain, feet excepted."""
        context = self.GetMyContextFromRoot(root_context)
        return touching_links(self.GetOutputPort("contact_results").Eval(context), self.contact_geometries)

    def _add_camera(self, builder: DiagramBuilder) -> MultibodyPlant:
        """Adds the cameras with a scene of their own, whose poses are computed when an image is read.

        In the plant's scene, the renderer would follow every step of the physics, which takes longer than the physics.
        """
        plant = MultibodyPlant(time_step=self.config.time_step)
        scene = builder.AddNamedSystem("camera_scene", SceneGraph())
        plant.RegisterAsSourceForSceneGraph(scene)
        add_terrain_to_plant(self.terrain, plant)
        self.robot.add_to_plant(plant)
        plant.Finalize()
        poses = builder.AddNamedSystem("camera_scene_poses", MultibodyPositionToGeometryPose(plant, True))
        builder.Connect(self.plant.get_state_output_port(), poses.get_input_port())
        builder.Connect(poses.get_output_port(), scene.get_source_pose_port(plant.get_source_id()))

        base = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName("base").index())
        names = [self.config.camera_name, *self.config.further_cameras]
        for name, suffix in zip(names, ["", *(f"_{name}" for name in names[1:])], strict=True):
            camera = add_depth_camera(builder, scene, base, self.robot.camera(name), self.config.camera)
            builder.Connect(scene.get_query_output_port(), camera.query_object_input_port())
            builder.ExportOutput(camera.depth_image_32F_output_port(), "depth_image" + suffix)
            builder.ExportOutput(camera.body_pose_in_world_output_port(), "camera_pose" + suffix)
        return plant

    def _add_sensors(self, builder: DiagramBuilder) -> None:
        plant, robot, config = self.plant, self.robot, self.config
        instance = plant.GetModelInstanceByName(robot.name)
        estimator = builder.AddNamedSystem(
            "state_estimator",
            OracleStateEstimator(robot, self.contact_geometries, contact_threshold=config.contact_threshold),
        )
        builder.Connect(plant.get_state_output_port(instance), estimator.GetInputPort("state"))
        builder.Connect(plant.get_contact_results_output_port(), estimator.GetInputPort("contact_results"))
        builder.Connect(plant.get_net_actuation_output_port(instance), estimator.GetInputPort("joint_torques"))
        builder.ExportOutput(estimator.GetOutputPort("robot_state"), "robot_state")

        imu = builder.AddNamedSystem("imu", Imu(robot, plant, config.imu, seed=config.seed))
        for name in ("body_poses", "body_spatial_velocities", "body_spatial_accelerations"):
            builder.Connect(plant.GetOutputPort(name), imu.GetInputPort(name))
        builder.ExportOutput(imu.GetOutputPort("imu"), "imu")

    def _export_plant_ports(self, builder: DiagramBuilder) -> None:
        plant, instance = self.plant, self.plant.GetModelInstanceByName(self.robot.name)
        late = round(self.config.model_error.actuator_delay / self.config.time_step)
        for name, port in (
            ("feedforward_torque", plant.get_actuation_input_port(instance)),
            ("desired_joint_state", plant.get_desired_state_input_port(instance)),
        ):
            if late > 0:
                delay = DiscreteTimeDelay(self.config.time_step, late, port.size())
                self._delays[name] = builder.AddNamedSystem(f"{name}_delay", delay)
                builder.Connect(delay.get_output_port(), port)
                port = delay.get_input_port()
            builder.ExportInput(port, name)
        builder.ExportInput(plant.get_applied_spatial_force_input_port(), "applied_spatial_force")
        builder.ExportOutput(plant.get_state_output_port(), "plant_state")
        builder.ExportOutput(plant.get_net_actuation_output_port(instance), "joint_torques")
        builder.ExportOutput(plant.get_contact_results_output_port(), "contact_results")
        builder.ExportOutput(self.scene_graph.get_query_output_port(), "query_object")


def make_simulation_station(robot: RobotModel, terrain: Terrain, config: StationConfig, meshcat=None) -> SimulationStation:
    """Builds the station; the ports are the same for every robot."""
    return SimulationStation(robot, terrain, config, meshcat)


def standing_pose(robot: RobotModel, truth: GroundTruth, x: float, y: float, yaw: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns base position [m] and joint angles (12,) of the robot standing on the ground with its torso level.

    The torso is at nominal height above the mean ground under the feet.
    """
    where = f"start {x:g},{y:g},{yaw:g}"
    heading = yaw_matrix(yaw)
    feet = robot.nominal_footholds_B @ heading.T + [x, y, 0.0]
    heights = np.asarray(truth.height(feet[:, 0], feet[:, 1]))
    if not np.isfinite(heights).all():
        missing = Leg(int(np.flatnonzero(~np.isfinite(heights))[0])).name
        raise UserInputError(f"{where}: there is no ground under the foot {missing}; start where all four feet find some")
    # The centre of a sphere that rests on a slope is radius / n_z above the slope, measured vertically.
    feet[:, 2] = heights + robot.foot_radius / np.maximum(truth.normal(feet[:, 0], feet[:, 1])[:, 2], 0.5)
    p_WB = np.array([x, y, heights.mean() + robot.nominal_base_height])
    q = np.empty(len(robot.joint_names))
    for leg in Leg:
        p_BF = (feet[leg] - p_WB) @ heading
        q[leg.joints], reached = robot.leg_inverse_kinematics_B(leg, p_BF)
        if not reached:
            raise UserInputError(f"{where}: the ground under the foot {leg.name} is out of reach; start on more even ground")
    return p_WB, q


def _add_plant(builder: DiagramBuilder, robot: RobotModel, terrain: Terrain, config: StationConfig):
    plant_config = MultibodyPlantConfig(
        time_step=config.time_step,
        contact_model="point",
        discrete_contact_approximation=config.contact_approximation,
    )
    plant, scene_graph = AddMultibodyPlant(plant_config, builder)
    friction = config.model_error.friction
    if friction is not None:
        terrain = replace(terrain, friction=friction)
    add_terrain_to_plant(terrain, plant)
    instance = robot.add_to_plant(plant)
    add_payload(plant, robot, config.model_error)
    for geometry in _collision_geometries(plant, instance):
        _set_friction(plant, scene_graph, geometry, terrain.friction)
    stiffness = robot.stiffness if config.stiffness is None else np.tile(config.stiffness, len(Leg))
    damping = robot.damping if config.damping is None else np.tile(config.damping, len(Leg))
    for name, p, d in zip(robot.joint_names, stiffness, damping, strict=True):
        plant.GetJointActuatorByName(name, instance).set_controller_gains(PdControllerGains(p=p, d=d))
    plant.Finalize()
    return plant, scene_graph


def _collision_geometries(plant: MultibodyPlant, instance) -> list[GeometryId]:
    bodies = [plant.get_body(index) for index in plant.GetBodyIndices(instance)]
    return [geometry for body in bodies for geometry in plant.GetCollisionGeometriesForBody(body)]


def _set_friction(plant: MultibodyPlant, scene_graph, geometry: GeometryId, friction: float) -> None:
    """Gives a geometry the terrain's friction: Drake takes 2 m1 m2/(m1 + m2) of a pair, which then is the terrain's too."""
    properties = scene_graph.model_inspector().GetProximityProperties(geometry)
    coulomb = CoulombFriction(friction, friction)
    properties.UpdateProperty("material", "coulomb_friction", coulomb)
    scene_graph.AssignRole(plant.get_source_id(), geometry, properties, RoleAssign.kReplace)
