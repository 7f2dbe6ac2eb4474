"""RobotModel: everything the stages need to know about a robot, read from its URDF and robot.yaml."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import Role, SceneGraph, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.robots import kinematic_tree as kinematics
from quadpips_drake.robots.kinematic_tree import KinematicTree
from quadpips_drake.robots.leg_inverse_kinematics import follow_feet, solve_leg
from quadpips_drake.robots.leg_shapes import LegShapes, read_leg_shapes
from quadpips_drake.robots.robot_description import CameraDescription, CameraMount, RobotDescription, mount_camera
from quadpips_drake.values.legs import JOINTS_PER_LEG, Leg
from quadpips_drake.values.robot_state import RobotState

JOINT_NAMES = tuple(f"{leg.name}_{joint}" for leg in Leg for joint in ("HAA", "HFE", "KFE"))
LINK_NAMES = ("base", *(f"{leg.name}_{link}" for leg in Leg for link in ("HIP", "THIGH", "SHANK")))
_LIMIT_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class RobotModel:
    """A quadruped with three joints per leg (HAA about x, HFE and KFE about y). Arrays are read-only.

    Frames: W world, B base; F is the centre of a foot's collision sphere. Joints are ordered leg by leg (LF, RF, LH, RH).
    """

    name: str
    title: str
    """Name for people."""
    urdf_path: Path
    joint_names: tuple
    tree: KinematicTree
    position_limits_lower: np.ndarray
    """[rad], (12,)."""
    position_limits_upper: np.ndarray
    """[rad], (12,)."""
    velocity_limits: np.ndarray
    """[rad/s], (12,)."""
    effort_limits: np.ndarray
    """[N m], (12,)."""
    rotor_inertia: np.ndarray
    """Inertia of the drives' rotors as felt at the joints [kg m^2], (12,)."""
    foot_radius: float
    """[m]."""
    leg_shapes: LegShapes
    """Collision shapes of thighs and shanks, feet included, as capsules."""
    leg_clearance: float
    """Least distance between them in a stance [m]."""
    effort_share: float
    """Largest share of its effort that a joint may need to carry half the weight [-]."""
    nominal_joints: np.ndarray
    """Joint angles of the nominal stance [rad], (12,)."""
    camera_mounts: tuple
    """The CameraMounts; one is named "front"."""
    imu_position: np.ndarray
    """Accelerometer in the base frame [m], (3,)."""
    stiffness: np.ndarray
    """Default proportional gains of the drives [N m/rad], (12,)."""
    damping: np.ndarray
    """Default derivative gains of the drives [N m s/rad], (12,)."""
    cameras: tuple = ()
    """The CameraDescriptions behind the mounts."""
    description_path: Path | None = None
    """The robot.yaml that it was read from."""

    @property
    def mass(self) -> float:
        """Total mass [kg]."""
        return float(self.tree.link_mass.sum())

    @property
    def hip_positions_B(self) -> np.ndarray:
        """Origins of the HAA joints in the base frame [m], (4, 3)."""
        return self.tree.joint_offset[::JOINTS_PER_LEG]

    @property
    def nominal_footholds_B(self) -> np.ndarray:
        """Foot centres at the nominal joints in the base frame [m], (4, 3)."""
        return self.foot_positions_B(self.nominal_joints)

    @property
    def nominal_base_height(self) -> float:
        """Height of the base origin above flat ground when standing at the nominal joints [m]."""
        return float(self.foot_radius - self.nominal_footholds_B[:, 2].mean())

    def camera(self, name: str = "front") -> CameraMount:
        """Returns the mount with that name."""
        for mount in self.camera_mounts:
            if mount.name == name:
                return mount
        raise unknown_name("camera", name, [mount.name for mount in self.camera_mounts])

    def with_camera_pitch(self, name: str, pitch: float) -> "RobotModel":
        """Returns a model whose camera ``name`` looks ``pitch`` [rad] below the horizon; all else is shared."""
        self.camera(name)
        mounts = [mount_camera(camera, pitch if camera.name == name else None) for camera in self.cameras]
        return replace(self, camera_mounts=tuple(mounts))

    def foot_positions_B(self, q: np.ndarray) -> np.ndarray:
        """Returns the foot centres in the base frame [m], (4, 3), at joint angles ``q`` (12,)."""
        tree = self.tree
        return kinematics.foot_positions_B(tree.joint_axis, tree.joint_offset, tree.foot_offset, np.array(q, float))

    def foot_positions_at(self, p_WB: np.ndarray, R_WB: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Returns the foot centres in W [m], (4, 3), with the base at ``p_WB``, ``R_WB`` and the joints at ``q`` (12,)."""
        return p_WB + self.foot_positions_B(q) @ R_WB.T

    def foot_positions_W(self, state: RobotState) -> np.ndarray:
        """Returns the foot centres in W [m], (4, 3), of a measured or estimated state."""
        return self.foot_positions_at(state.p_WB, state.R_WB, state.joint_positions)

    def soles_W(self, centers: np.ndarray) -> np.ndarray:
        """Returns the lowest points of feet with these ``centers`` in W [m], (..., 3): where they touch level ground."""
        return centers - np.array([0.0, 0.0, self.foot_radius])

    def foot_jacobians_B(self, q: np.ndarray) -> np.ndarray:
        """Returns the derivative of each foot centre in the base frame by its leg's joints: [leg, xyz, joint]."""
        tree = self.tree
        return kinematics.foot_jacobians_B(tree.joint_axis, tree.joint_offset, tree.foot_offset, np.array(q, float))

    def link_poses_B(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns rotations (13, 3, 3) and origins (13, 3) of all links in the base frame."""
        return kinematics.link_poses_B(self.tree.joint_axis, self.tree.joint_offset, np.array(q, float))

    def leg_inverse_kinematics_B(self, leg: int, p_BF: np.ndarray, guess: np.ndarray | None = None):
        """Finds the angles (HAA, HFE, KFE) that put the foot's centre at ``p_BF`` [m, base frame].

        Of several solutions within the joint limits, the one closest to ``guess`` (default: nominal stance) is taken.

        Returns:
            The angles (3,) and a flag, which is False when the foot cannot be reached within the limits; the angles are then
            the nearest sensible ones.
        """
        joints = slice(JOINTS_PER_LEG * leg, JOINTS_PER_LEG * (leg + 1))
        hip, thigh, knee = self.tree.joint_offset[joints]
        guess = np.array(self.nominal_joints[joints] if guess is None else guess, float)
        return solve_leg(
            np.asarray(p_BF, float) - hip,
            thigh,
            knee,
            self.tree.foot_offset[leg],
            self.position_limits_lower[joints],
            self.position_limits_upper[joints],
            guess,
            _LIMIT_TOLERANCE,
        )

    def joints_following(self, p_WB, rpy_WB, p_WF, guess) -> tuple[np.ndarray, np.ndarray]:
        """Finds the joint angles along a motion of base and feet.

        Args:
            p_WB, rpy_WB: base poses [m, rad], (n, 3) each.
            p_WF: foot centres in W [m], (n, 4, 3).
            guess: angles to begin close to [rad], (12,); from then on each is close to the one before.

        Returns:
            The angles (n, 12) and whether each foot is reached within the limits, bool (n, 4); where it is not, the angles
            are the nearest sensible ones.
        """
        joints, reached = np.empty((len(p_WB), len(self.joint_names))), np.empty((len(p_WB), 4), dtype=bool)
        motion = (np.array(part, dtype=float) for part in (p_WB, rpy_WB, p_WF, guess))
        limits = self.position_limits_lower, self.position_limits_upper
        follow_feet(self.tree.joint_offset, self.tree.foot_offset, *limits, _LIMIT_TOLERANCE, *motion, joints, reached)
        return joints, reached

    def add_to_plant(self, plant: MultibodyPlant) -> ModelInstanceIndex:
        """Adds the robot to a plant that is not yet finalized: quaternion floating base "base", joints in our order."""
        (instance,) = Parser(plant).AddModels(str(self.urdf_path))
        plant.RenameModelInstance(instance, self.name)
        return instance

    def set_state(self, plant: MultibodyPlant, plant_context, p_WB, rpy_WB, q) -> None:
        """Sets base pose [m, rad] and joint angles (12,) in a plant's context; all velocities become zero."""
        instance = plant.GetModelInstanceByName(self.name)
        quaternion: Quaternion = RollPitchYaw(np.asarray(rpy_WB, float)).ToQuaternion()
        positions = np.concatenate([quaternion.wxyz(), np.asarray(p_WB, float), np.asarray(q, float)])
        plant.SetPositions(plant_context, instance, positions)
        plant.SetVelocities(plant_context, instance, np.zeros(plant.num_velocities(instance)))


def read_model(name: str, urdf_path: Path, description: RobotDescription) -> RobotModel:
    """Reads limits, masses and geometry out of the URDF by way of a throw-away plant."""
    plant = MultibodyPlant(time_step=1e-3)
    scene_graph = SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    Parser(plant).AddModels(str(urdf_path))
    plant.Finalize()
    joints = [plant.GetJointByName(joint) for joint in JOINT_NAMES]
    actuators = [plant.GetJointActuatorByName(joint) for joint in JOINT_NAMES]
    if plant.num_joints() != len(JOINT_NAMES) + 1:  # one more for the floating base
        raise UserInputError(f"{urdf_path.name}: expected the joints {', '.join(JOINT_NAMES)} and no others")
    foot_offset, foot_radius = _read_feet(plant, scene_graph)
    return RobotModel(
        name=name,
        title=description.title,
        urdf_path=urdf_path,
        joint_names=JOINT_NAMES,
        tree=_read_tree(plant, joints, foot_offset),
        position_limits_lower=_constant([joint.position_lower_limit() for joint in joints]),
        position_limits_upper=_constant([joint.position_upper_limit() for joint in joints]),
        velocity_limits=_constant([joint.velocity_upper_limit() for joint in joints]),
        effort_limits=_constant([actuator.effort_limit() for actuator in actuators]),
        rotor_inertia=_constant([actuator.default_reflected_inertia() for actuator in actuators]),
        foot_radius=foot_radius,
        leg_shapes=read_leg_shapes(plant, scene_graph),
        leg_clearance=description.leg_clearance,
        effort_share=description.effort_share,
        nominal_joints=_constant(description.nominal_joints),
        camera_mounts=tuple(mount_camera(camera) for camera in description.cameras),
        imu_position=_constant(description.imu_position),
        stiffness=_constant(np.tile(description.stiffness, 4)),
        damping=_constant(np.tile(description.damping, 4)),
        cameras=tuple(description.cameras),
    )


def _read_tree(plant: MultibodyPlant, joints, foot_offset) -> KinematicTree:
    context = plant.CreateDefaultContext()
    masses, coms, inertias = [], [], []
    for link in LINK_NAMES:
        body = plant.GetBodyByName(link)
        spatial_inertia = body.CalcSpatialInertiaInBodyFrame(context)
        masses.append(spatial_inertia.get_mass())
        coms.append(spatial_inertia.get_com())
        about_com = spatial_inertia.Shift(spatial_inertia.get_com()).CalcRotationalInertia()
        inertias.append(about_com.CopyToFullMatrix3())
    return KinematicTree(
        joint_axis=_constant([joint.revolute_axis() for joint in joints]),
        joint_offset=_constant([joint.frame_on_parent().GetFixedPoseInBodyFrame().translation() for joint in joints]),
        foot_offset=_constant(foot_offset),
        link_mass=_constant(masses),
        link_com=_constant(coms),
        link_inertia=_constant(inertias),
    )


def _read_feet(plant: MultibodyPlant, scene_graph: SceneGraph) -> tuple[list, float]:
    """Returns the centres of the feet's collision spheres in their shanks' frames, and their radius."""
    inspector = scene_graph.model_inspector()
    offsets, radii = [], []
    for leg in Leg:
        frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(f"{leg.name}_SHANK").index())
        for geometry in inspector.GetGeometries(frame, Role.kProximity):
            if inspector.GetName(geometry).endswith("_foot") and isinstance(inspector.GetShape(geometry), Sphere):
                pose: RigidTransform = inspector.GetPoseInFrame(geometry)
                offsets.append(pose.translation())
                radii.append(inspector.GetShape(geometry).radius())
    if len(offsets) != len(Leg) or len(set(radii)) != 1:
        raise UserInputError("the URDF needs one collision sphere named <leg>_SHANK_foot per leg, all of one radius")
    return offsets, float(radii[0])


def _constant(values) -> np.ndarray:
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


__all__ = [
    "JOINT_NAMES",
    "LINK_NAMES",
    "CameraDescription",
    "CameraMount",
    "KinematicTree",
    "RobotModel",
    "read_model",
]
