"""Whole-body configurations that stand on given footholds: targets of the swing optimisation (QuadPiPS section VI-D)."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.configuration.schema import MAX_SEED, configuration, ranged
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import Stance


@configuration
class TargetConfig:
    """How a base pose is looked for from which all feet reach their footholds."""

    samples: int = ranged(25, 1, 1000)
    """Base poses that are tried, the nominal one first [-]."""
    horizontal_range: float = ranged(0.075, 0.0, 1.0)
    """Samples are moved by up to this in x and y [m]."""
    vertical_range: float = ranged(0.05, 0.0, 1.0)
    """Samples are moved by up to this in z [m]."""
    seed: int = ranged(0, 0, MAX_SEED)
    """Of the sampling."""


@dataclass(frozen=True, eq=False)
class TargetConfiguration:
    """Base pose and joints above a stance."""

    p_WB: np.ndarray
    """[m], (3,)"""
    rpy_WB: np.ndarray
    """[rad], (3,)"""
    joints: np.ndarray
    """[rad], (12,); where ``reached`` is False the closest that the legs can do."""
    reached: bool
    """Whether all feet are on their footholds."""
    unreached: tuple = ()
    """Legs that do not reach."""


def foot_centers(stance: Stance, foot_radius: float) -> np.ndarray:
    """Returns the centres of the feet that stand on the stance's footholds [m], (4, 3)."""
    return stance.footholds + foot_radius * stance.normals


def leg_angles(robot: RobotModel, p_WB, rpy_WB, feet, guess) -> tuple[np.ndarray, list[Leg]]:
    """Returns the joints (12,) that put the feet at ``feet`` (4, 3) in W, close to ``guess``, and the legs that cannot."""
    joints, reached = robot.joints_following([p_WB], [rpy_WB], [feet], guess)
    return joints[0], [leg for leg in Leg if not reached[0, leg]]


def find_target(robot: RobotModel, p_WB, rpy_WB, feet, config: TargetConfig, guess=None) -> TargetConfiguration:
    """Finds a configuration with its feet at ``feet`` (4, 3) and its base near the given pose.

    The nominal pose comes first; when a leg does not reach, poses around it are sampled and the first one wins from which
    all legs reach. If there is none, the one that most legs reach from is returned, with ``reached`` False.
    """
    rng = np.random.default_rng(config.seed)
    spread = np.array([config.horizontal_range, config.horizontal_range, config.vertical_range])
    guess = robot.nominal_joints if guess is None else guess
    best = None
    for sample in range(config.samples):
        position = np.asarray(p_WB, dtype=float) + (rng.uniform(-spread, spread) if sample else 0.0)
        joints, failed = leg_angles(robot, position, rpy_WB, feet, guess)
        found = TargetConfiguration(position, np.array(rpy_WB, dtype=float), joints, not failed, tuple(failed))
        if found.reached:
            return found
        if best is None or len(failed) < len(best.unreached):
            best = found
    return best
