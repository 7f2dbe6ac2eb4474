"""What a robot's ``robot.yaml`` says beside its URDF."""

import math
from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.values.legs import JOINTS_PER_LEG, NUM_JOINTS


@configuration
class CameraDescription:
    """Where a depth camera sits and looks."""

    name: str = "front"
    """By which the station's configuration chooses it; one must be called front."""
    position: list[float] = ranged([0.0, 0.0, 0.0], -10.0, 10.0)
    """Optical centre in the base frame [m], 3 values."""
    yaw: float = ranged(0.0, -6.3, 6.3)
    """Viewing direction from straight ahead, positive to the left [rad]."""
    pitch: float = ranged(0.0, -1.5708, 1.5708)
    """Viewing direction below the horizon [rad]."""


@dataclass(frozen=True, eq=False)
class CameraMount:
    """A camera fixed to the base."""

    name: str
    X_BC: np.ndarray
    """Pose of the optical frame C (x right, y down, z forward) in the base frame, (4, 4)."""


@configuration
class RobotDescription:
    """The schema of ``models/<robot>/robot.yaml``."""

    name: str = ""
    """In results and names of directories; default: that of the folder, or of a file that is not called robot.yaml."""
    title: str = ""
    """Name for people."""
    urdf: str = ""
    """File name of the URDF, beside this file."""
    nominal_joints: list[float] = ranged([0.0] * NUM_JOINTS, -6.3, 6.3)
    """Joint angles of the nominal stance [rad], leg by leg."""
    cameras: list[CameraDescription] = field(default_factory=lambda: [CameraDescription()])
    """Depth cameras."""
    imu_position: list[float] = ranged([0.0, 0.0, 0.0], -10.0, 10.0)
    """Accelerometer in the base frame [m]."""
    leg_clearance: float = ranged(0.02, 0.0, 0.5)
    """Least distance between the collision shapes of two legs in a stance [m]: how narrow it may be."""
    effort_share: float = ranged(0.9, 0.05, 10.0)
    """Largest share of its effort that a joint may need to carry half the weight [-]: how wide and long a stance may be."""
    stiffness: list[float] = ranged([0.0] * JOINTS_PER_LEG, 0.0, 1e5)
    """Proportional gains of the drives for HAA, HFE, KFE [N m/rad]."""
    damping: list[float] = ranged([0.0] * JOINTS_PER_LEG, 0.0, 1e4)
    """Derivative gains of the drives for HAA, HFE, KFE [N m s/rad]."""

    def __post_init__(self):
        if not any(camera.name == "front" for camera in self.cameras):
            raise UserInputError("cameras must include one named 'front'")


def mount_camera(camera: CameraDescription, pitch: float | None = None) -> CameraMount:
    """Turns a camera's description into its pose; ``pitch`` [rad below the horizon] replaces the described one."""
    pitch = camera.pitch if pitch is None else pitch
    cy, sy, cp, sp = math.cos(camera.yaw), math.sin(camera.yaw), math.cos(pitch), math.sin(pitch)
    forward = np.array([cy * cp, sy * cp, -sp])
    right = np.array([sy, -cy, 0.0])
    X_BC = np.eye(4)
    X_BC[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    X_BC[:3, 3] = camera.position
    X_BC.flags.writeable = False
    return CameraMount(camera.name, X_BC)
