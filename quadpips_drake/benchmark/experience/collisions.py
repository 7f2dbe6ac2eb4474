"""Whether a motion touches a sphere: feet and shanks along it, exactly."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.legs import JOINTS_PER_LEG, Leg

_SHANK = 1
"""How LegShapes calls it; the foot belongs to it."""
_BETWEEN = 4
"""Parts of the time between two states at which is looked, too: a foot moves up to 2 cm from state to state."""


@dataclass(frozen=True)
class Contact:
    """The first moment at which something is touched."""

    state: float
    """Number of the state, from 0 on; a fraction between two."""
    leg: Leg
    sphere: int
    """Which one."""
    depth: float
    """How far its shape is in it then [m]."""


def first_contact(robot: RobotModel, states: np.ndarray, centers: np.ndarray, radii: np.ndarray) -> Contact | None:
    """Returns where feet and shanks first touch a sphere, or None.

    They are the capsules of the robot's collision shapes, so that the distances are exact; between two states the
    configuration is interpolated.

    Args:
        states: of the centroidal model, (n, 24).
        centers, radii: of the spheres in W [m], (m, 3), (m,).
    """
    if not len(radii):
        return None
    steps = np.arange((len(states) - 1) * _BETWEEN + 1) / _BETWEEN
    before = np.minimum(steps.astype(int), len(states) - 2)
    x = states[before] + (steps - before)[:, None] * (states[before + 1] - states[before])
    depths = np.stack([(radii - gaps).T for gaps in _gaps(robot, x, centers)])  # leg, sphere, step
    touched = (depths > 0.0).any(axis=(0, 1))
    if not touched.any():
        return None
    step = int(touched.argmax())
    leg, sphere = np.unravel_index(depths[:, :, step].argmax(), depths.shape[:2])
    return Contact(float(steps[step]), Leg(int(leg)), int(sphere), float(depths[leg, sphere, step]))


def _gaps(robot: RobotModel, x: np.ndarray, centers: np.ndarray):
    """Yields the distances from the surface of each leg's shank and foot to points [m], (n, m), at the states (n, 24)."""
    poses = [robot.link_poses_B(q) for q in x[:, CentroidalState.JOINTS]]
    rotations, origins = (np.array(part) for part in zip(*poses, strict=True))
    R_WB = np.array([rotation_from_rpy(rpy) for rpy in x[:, CentroidalState.ORIENTATION]])
    shapes = robot.leg_shapes
    for leg in Leg:
        link, least = JOINTS_PER_LEG * (leg + 1), np.full((len(x), len(centers)), np.inf)
        for k in np.flatnonzero((shapes.links[leg] == _SHANK) & (shapes.radii[leg] >= 0.0)):
            ends_B = origins[:, link, None] + shapes.ends[leg, k] @ rotations[:, link].transpose(0, 2, 1)
            ends = x[:, None, CentroidalState.POSITION] + ends_B @ R_WB.transpose(0, 2, 1)
            a, axis = ends[:, 0], ends[:, 1] - ends[:, 0]
            offset = centers - a[:, None]
            squared = np.maximum((axis * axis).sum(axis=1), 1e-12)[:, None]
            along = np.clip(np.einsum("nmi,ni->nm", offset, axis) / squared, 0.0, 1.0)
            nearest = np.linalg.norm(offset - along[..., None] * axis[:, None], axis=2)
            least = np.minimum(least, nearest - shapes.radii[leg, k])
        yield least
