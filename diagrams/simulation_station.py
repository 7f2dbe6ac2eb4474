"""The simulation station: a robot on a terrain, with its drives and sensors, behind ports that a real one could have."""

from dataclasses import field, replace

import numpy as np
from pydrake.geometry import GeometryId, MeshcatVisualizer, RoleAssign, SceneGraph
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    CoulombFriction,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.primitives import Demultiplexer, DiscreteTimeDelay, Multiplexer
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.faults.model_errors import ModelErrorConfig, add_payload, set_base_mass
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.framework.systems import Diagram
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.sensing.contact_sensing import deepest_overlap, find_contact_geometries
from quadpips_drake.sensing.depth_camera import DepthCameraConfig, add_depth_camera, make_intrinsics
from quadpips_drake.sensing.foot_contact_sensor_system import FootContactSensor
from quadpips_drake.sensing.imu_system import Imu, ImuConfig
from quadpips_drake.terrain.appearing.appearing_bodies import AppearingBodies, add_appearing_to_camera_scene
from quadpips_drake.terrain.appearing.appearing_poses_system import AppearingPoses
from quadpips_drake.terrain.camera_scene import add_terrain_to_camera_scene
from quadpips_drake.terrain.ground_window import GroundWindow
from quadpips_drake.terrain.ground_window_system import GroundWindowGuard
from quadpips_drake.terrain.plant_builder import add_terrain_to_plant, element_index
from quadpips_drake.terrain.standing_pose import standing_pose
from quadpips_drake.terrain.terrain import Element, Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.legs import JOINTS_PER_LEG, NUM_JOINTS, Leg


@configuration
class StationConfig:
    """Physics, drives and sensors of the simulation."""

    time_step: float = ranged(0.001, 1e-5, 0.01)
    """Step of the physics [s]."""
    contact_approximation: str = "sap"
    """Drake's contact solver: sap, similar or lagged (tamsi knows no joint PD)."""
    stiffness: list[float] | None = ranged(None, 0.0, 1e5, lengths=(JOINTS_PER_LEG,))
    """Proportional gains of the drives for HAA, HFE, KFE [N m/rad]; null: the robot's."""
    damping: list[float] | None = ranged(None, 0.0, 1e4, lengths=(JOINTS_PER_LEG,))
    """Derivative gains of the drives for HAA, HFE, KFE [N m s/rad]; null: the robot's."""
    contact_threshold: float = ranged(5.0, 0.0, 1e4)
    """Force from which on a foot is reported to be in contact [N]."""
    camera_name: str = "front"
    """Which of the robot's cameras is the depth camera, at which perception's egocan stands."""
    further_cameras: list[str] = field(default_factory=list)
    """Which others look around as well, for example [left, right, rear]; each costs its rendering, normals and egocan."""
    camera_pitch: float | None = ranged(None, -1.5, 1.5)
    """Viewing direction of that camera below the horizon [rad]; null: the robot's."""
    camera: DepthCameraConfig = field(default_factory=DepthCameraConfig)
    imu: ImuConfig = field(default_factory=ImuConfig)
    model_error: ModelErrorConfig = field(default_factory=ModelErrorConfig)

    def __post_init__(self):
        if self.contact_approximation not in ("sap", "similar", "lagged"):
            raise UserInputError(f"contact_approximation must be sap, similar or lagged, not '{self.contact_approximation}'")
        if len({self.camera_name, *self.further_cameras}) != 1 + len(self.further_cameras):
            raise UserInputError(f"further_cameras must name other cameras than '{self.camera_name}', each once")


MAX_OVERLAP = 0.01
"""How deep body and legs may be inside the terrain at the start [m]: contact pushes them out."""


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
        - foot_contacts
        - joint_encoders
        - imu
        - joint_torques
        - plant_state
        - contact_results
        - query_object

    - feedforward_torque: [N m], vector (12,).
    - desired_joint_state: joint positions [rad] and velocities [rad/s], vector (24,).
    - applied_spatial_force: list of pydrake ExternallyAppliedSpatialForce, frame W: pushes.
    - depth_image: ImageDepth32F (width, height) [m], along the optical axis; 0 too near, inf too far or nothing there. It is
      rendered when it is read, without delay: whoever samples it sets the rate.
    - camera_pose: RigidTransform X_WC of the optical frame (x right, y down, z forward).
    - depth_image_<camera>, camera_pose_<camera>: the same of the further cameras.
    - foot_contacts: FootContacts, what the feet feel, forces in W.
    - joint_encoders: joint positions [rad] and velocities [rad/s], vector (24,).
    - imu: angular velocity [rad/s], specific force [m/s^2] in the base's axes, vector (6,).
    - joint_torques: what the drives applied in the last step, after clamping [N m], vector (12,).

    Oracle ports, which no real robot has:

    - plant_state: positions and velocities of the plant, vector (37,).
    - contact_results: ContactResults of the last step.
    - query_object: SceneGraph's QueryObject.
    """

    def __init__(
        self,
        robot: RobotModel,
        terrain: Terrain,
        config: StationConfig,
        meshcat=None,
        *,
        appearing: tuple[Element, ...] = (),
        seed: int = 0,
    ):
        """
        Args:
            robot: model of the robot.
            terrain: the world.
            config: physics, drives and sensors.
            meshcat: where to draw.
            appearing: elements that are not there until ``let_appear``.
            seed: of the sensors' noise.
        """
        Diagram.__init__(self)
        if config.camera_pitch is not None:
            robot = robot.with_camera_pitch(config.camera_name, config.camera_pitch)
        self.robot = robot
        """The RobotModel, with the camera as configured."""
        self.terrain = terrain
        self.config = config
        self.camera_intrinsics = make_intrinsics(config.camera)
        self._truth = GroundTruth(terrain)
        self._delays: dict[str, DiscreteTimeDelay] = {}

        builder = DiagramBuilder()
        self.plant, self.scene_graph, window, self._appearing = _add_plant(builder, robot, terrain, config, appearing)
        self._window_guard = None if window is None else self._add_window_guard(builder, window)
        self.contact_geometries = find_contact_geometries(robot, self.plant, self.scene_graph.model_inspector())
        self._camera_plant = self._add_camera(builder)
        self._add_sensors(builder, seed)
        self._export_plant_ports(builder)
        if meshcat is not None:
            MeshcatVisualizer.AddToBuilder(builder, self.scene_graph, meshcat)
        builder.BuildInto(self)
        self.set_name("station")

    def set_initial_state(self, root_context, x: float, y: float, yaw: float) -> None:
        """Stands the robot on the terrain, at rest: torso level above (x, y) [m], turned by ``yaw`` [rad].

        Each foot rests on the ground below its nominal place, by inverse kinematics.

        Raises:
            UserInputError: a foot would find no ground, or cannot reach it, or body or legs would be inside the terrain.
        """
        p_WB, q = standing_pose(self.robot, self._truth, x, y, yaw)
        plant_context = self.plant.GetMyMutableContextFromRoot(root_context)
        self.robot.set_state(self.plant, plant_context, p_WB, [0.0, 0.0, yaw], q)
        set_base_mass(self.plant, plant_context, self.robot, self.config.model_error)
        self.bring_ground_near(root_context)
        self._check_free_space(root_context, f"start {x:g},{y:g},{yaw:g}")
        if self._delays:
            # What the drives got before the first command arrives: hold the stance.
            for name, before in (("feedforward_torque", np.zeros(NUM_JOINTS)), ("desired_joint_state", np.r_[q, 0.0 * q])):
                state = self._delays[name].GetMyMutableContextFromRoot(root_context).get_mutable_discrete_state_vector()
                state.SetFromVector(np.resize(before, state.size()))

    def _check_free_space(self, root_context, where: str) -> None:
        """Refuses a start at which the body or a leg is inside the terrain, as astride a wall."""
        query = self.GetOutputPort("query_object").Eval(self.GetMyContextFromRoot(root_context))
        overlap = deepest_overlap(query, self.contact_geometries, self.robot.foot_radius)
        if overlap is not None and overlap[2] > MAX_OVERLAP:
            link, shape, depth = overlap
            title = self.terrain.elements[element_index(shape)].title
            raise UserInputError(
                f"{where}: the robot's {link} would be {depth:.2f} m inside {title}; start where body and legs have room"
            )

    def bring_ground_near(self, root_context) -> None:
        """Has to be called often while a simulation goes on: of a very large terrain only what is near can be touched.

        On other terrains it does nothing; see ``GroundWindow``.
        """
        if self._window_guard is not None:
            scene_context = self.scene_graph.GetMyMutableContextFromRoot(root_context)
            self._window_guard.follow(self._window_guard.GetMyMutableContextFromRoot(root_context), scene_context)

    def let_appear(self, root_context, number: int, X_WE: np.ndarray) -> set[GeometryId]:
        """Puts one of the elements ``appearing`` to the pose ``X_WE`` (4, 4); returns what of it can be touched."""
        self._appearing.put(self.plant, self.plant.GetMyMutableContextFromRoot(root_context), number, X_WE)
        return self._appearing.geometries(self.plant, self.scene_graph.model_inspector(), number)

    def sink(self, root_context, numbers) -> None:
        """Puts elements ``appearing`` back to where nobody meets them."""
        for number in numbers:
            self._appearing.sink(self.plant, self.plant.GetMyMutableContextFromRoot(root_context), number)

    def _add_window_guard(self, builder: DiagramBuilder, window: GroundWindow) -> GroundWindowGuard:
        first = self.plant.GetBodyByName("base").floating_positions_start() + 4  # behind the quaternion
        guard = builder.AddSystem(GroundWindowGuard(window, self.plant.num_multibody_states(), first))
        builder.Connect(self.plant.get_state_output_port(), guard.GetInputPort("plant_state"))
        return guard

    def _add_camera(self, builder: DiagramBuilder) -> MultibodyPlant:
        """Adds the cameras with a scene of their own, whose poses are computed when an image is read.

        In the plant's scene, the renderer would follow every step of the physics, which takes longer than the physics.
        """
        plant = MultibodyPlant(time_step=self.config.time_step)
        plant.set_name("camera_plant")
        scene = builder.AddNamedSystem("camera_scene", SceneGraph())
        plant.RegisterAsSourceForSceneGraph(scene)
        add_terrain_to_camera_scene(self.terrain, plant)
        self.robot.add_to_plant(plant)
        plant.Finalize()
        poses = builder.AddNamedSystem("camera_scene_poses", MultibodyPositionToGeometryPose(plant, True))
        builder.Connect(self.plant.get_state_output_port(), poses.get_input_port())
        builder.Connect(poses.get_output_port(), scene.get_source_pose_port(plant.get_source_id()))
        if self._appearing.elements:
            source, frames = add_appearing_to_camera_scene(self._appearing.elements, scene)
            appearing = builder.AddSystem(AppearingPoses(self._appearing.bodies, frames))
            builder.Connect(self.plant.get_body_poses_output_port(), appearing.GetInputPort("body_poses"))
            builder.Connect(appearing.GetOutputPort("frame_poses"), scene.get_source_pose_port(source))

        base = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName("base").index())
        names = [self.config.camera_name, *self.config.further_cameras]
        for name, suffix in zip(names, ["", *(f"_{name}" for name in names[1:])], strict=True):
            camera = add_depth_camera(builder, scene, base, self.robot.camera(name), self.config.camera)
            builder.Connect(scene.get_query_output_port(), camera.query_object_input_port())
            builder.ExportOutput(camera.depth_image_32F_output_port(), "depth_image" + suffix)
            builder.ExportOutput(camera.body_pose_in_world_output_port(), "camera_pose" + suffix)
        return plant

    def _add_sensors(self, builder: DiagramBuilder, seed: int) -> None:
        plant, config = self.plant, self.config
        feet = builder.AddSystem(FootContactSensor(self.contact_geometries, threshold=config.contact_threshold))
        builder.Connect(plant.get_contact_results_output_port(), feet.GetInputPort("contact_results"))
        builder.ExportOutput(feet.GetOutputPort("foot_contacts"), "foot_contacts")

        # Positions are quaternion, position, joints; velocities are angular, linear, joints.
        parts = builder.AddNamedSystem("state_parts", Demultiplexer([7, NUM_JOINTS, 6, NUM_JOINTS]))
        joints = builder.AddNamedSystem("joint_encoders", Multiplexer([NUM_JOINTS, NUM_JOINTS]))
        builder.Connect(plant.get_state_output_port(), parts.get_input_port())
        builder.Connect(parts.get_output_port(1), joints.get_input_port(0))
        builder.Connect(parts.get_output_port(3), joints.get_input_port(1))
        builder.ExportOutput(joints.get_output_port(), "joint_encoders")

        imu = builder.AddNamedSystem("imu", Imu(self.robot, plant, config.imu, seed=seed))
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
        builder.ExportOutput(plant.get_net_actuation_output_port(instance), "joint_torques")
        builder.ExportOutput(plant.get_state_output_port(), "plant_state")
        builder.ExportOutput(plant.get_contact_results_output_port(), "contact_results")
        builder.ExportOutput(self.scene_graph.get_query_output_port(), "query_object")


def _add_plant(builder: DiagramBuilder, robot: RobotModel, terrain: Terrain, config: StationConfig, elements):
    plant_config = MultibodyPlantConfig(
        time_step=config.time_step,
        contact_model="point",
        discrete_contact_approximation=config.contact_approximation,
    )
    plant, scene_graph = AddMultibodyPlant(plant_config, builder)
    friction = config.model_error.friction
    if friction is not None:
        terrain = replace(terrain, friction=friction)
    window = add_terrain_to_plant(terrain, plant, scene_graph)
    instance = robot.add_to_plant(plant)
    add_payload(plant, robot, config.model_error)
    for geometry in _collision_geometries(plant, instance):
        _set_friction(plant, scene_graph, geometry, terrain.friction)
    stiffness = robot.stiffness if config.stiffness is None else np.tile(config.stiffness, len(Leg))
    damping = robot.damping if config.damping is None else np.tile(config.damping, len(Leg))
    for name, p, d in zip(robot.joint_names, stiffness, damping, strict=True):
        plant.GetJointActuatorByName(name, instance).set_controller_gains(PdControllerGains(p=p, d=d))
    appearing = AppearingBodies(elements, plant, terrain.friction)
    plant.Finalize()
    return plant, scene_graph, window, appearing


def _collision_geometries(plant: MultibodyPlant, instance) -> list[GeometryId]:
    bodies = [plant.get_body(index) for index in plant.GetBodyIndices(instance)]
    return [geometry for body in bodies for geometry in plant.GetCollisionGeometriesForBody(body)]


def _set_friction(plant: MultibodyPlant, scene_graph, geometry: GeometryId, friction: float) -> None:
    """Gives a geometry the terrain's friction: Drake takes 2 m1 m2/(m1 + m2) of a pair, which then is the terrain's too."""
    properties = scene_graph.model_inspector().GetProximityProperties(geometry)
    coulomb = CoulombFriction(friction, friction)
    properties.UpdateProperty("material", "coulomb_friction", coulomb)
    scene_graph.AssignRole(plant.get_source_id(), geometry, properties, RoleAssign.kReplace)
