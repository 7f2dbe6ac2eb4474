"""Synthetic region sets and robot states for the planners' tests."""

from dataclasses import replace

import numpy as np

from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.math.rotations import rotation_from_rpy, yaw_matrix
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.values.regions import PlanarRegion, RegionSet
from quadpips_drake.values.robot_state import RobotState


def patch(region_id, x, y, size_x, size_y, z=0.0, margin=0.04, slope=0.0, label=0):
    """A rectangle around (x, y, z), rising with ``slope`` [rad] along x."""
    X_WR = np.eye(4)
    X_WR[:3, :3] = [[np.cos(slope), 0, -np.sin(slope)], [0, 1, 0], [np.sin(slope), 0, np.cos(slope)]]
    X_WR[:3, 3] = [x, y, z]
    boundary = 0.5 * np.array([[-size_x, -size_y], [size_x, -size_y], [size_x, size_y], [-size_x, size_y]])
    return PlanarRegion(region_id, X_WR, boundary, boundary - margin * np.sign(boundary), label)


def tiles(x_range, y_range, pitch=0.15, size=0.15, z=0.0, slope=0.0, first_id=0, margin=0.02):
    """Square patches on a grid over a rectangle, as over-segmentation leaves them; ``z`` may be a function of x."""
    xs = np.arange(x_range[0] + pitch / 2, x_range[1], pitch)
    ys = np.arange(y_range[0] + pitch / 2, y_range[1], pitch)
    height = z if callable(z) else lambda x: z
    cells = [(x, y) for x in xs for y in ys]
    return [patch(first_id + k, x, y, size, size, height(x), margin=margin, slope=slope) for k, (x, y) in enumerate(cells)]


def region_set(*groups) -> RegionSet:
    """Joins lists of patches and numbers them."""
    regions = [region for group in groups for region in group]
    numbered = (PlanarRegion(k, r.X_WR, r.boundary, r.inset, r.label) for k, r in enumerate(regions))
    return RegionSet(0.0, tuple(numbered))


def flat_ground(x_range=(-0.8, 3.0), y_range=(-0.9, 0.9)) -> RegionSet:
    return region_set(tiles(x_range, y_range))


def stepping_stones(stone=0.30, gap=0.10, pit=1.5) -> RegionSet:
    """Two platforms, a pit and stones in a grid, as the terrain of that name."""
    pitch = stone + gap
    count = round((pit - gap) / pitch)
    stones = [
        patch(0, 0.7 + gap + stone / 2 + i * pitch, j * pitch, stone, stone, margin=0.05)
        for i in range(count)
        for j in (-2, -1, 0, 1, 2)
    ]
    far = 0.7 + count * pitch + gap
    return region_set(tiles((-0.8, 0.7), (-0.9, 0.9)), stones, tiles((far, far + 1.5), (-0.9, 0.9)))


def pit(width=1.2) -> RegionSet:
    return region_set(tiles((-0.8, 0.7), (-0.9, 0.9)), tiles((0.7 + width, 2.5 + width), (-0.9, 0.9)))


def stairs(rise=0.05, run=0.20) -> RegionSet:
    """Ten treads from x = 0.6 on, then a platform."""
    treads = [
        patch(0, 0.6 + run * (i + 0.5), y, run, 0.3, rise * (i + 1), margin=0.04)
        for i in range(10)
        for y in (-0.45, -0.15, 0.15, 0.45)
    ]
    return region_set(tiles((-0.8, 0.6), (-0.6, 0.6)), treads, tiles((2.6, 3.6), (-0.6, 0.6), z=10 * rise))


def ramp(angle=0.175) -> RegionSet:
    slope = np.tan(angle)
    return region_set(
        tiles((-0.8, 0.6), (-0.6, 0.6)), tiles((0.6, 3.0), (-0.6, 0.6), z=lambda x: slope * (x - 0.6), slope=angle)
    )


def beam(width) -> RegionSet:
    """Two platforms and a straight beam 1.8 m long."""
    strip = tiles((0.7, 2.5), (-0.5 * width, 0.5 * width), pitch=width, size=width, margin=0.045)
    return region_set(tiles((-0.8, 0.7), (-0.9, 0.9)), strip, tiles((2.5, 4.0), (-0.9, 0.9)))


def winding_beam(half_width=0.35) -> RegionSet:
    """A platform, then a beam that turns left by 90 degrees and right again."""
    w = half_width
    return region_set(
        tiles((-0.8, 0.7), (-0.9, 0.9)), tiles((0.7, 2.0 + w), (-w, w)), tiles((2.0 - w, 2.0 + w), (w, 2.0 + w)),
        tiles((2.0 + w, 4.0), (2.0 - w, 2.0 + w)),
    )  # fmt: skip


def standing_state(robot, x=0.0, y=0.0, yaw=0.0, z=0.0, stamp=0.0) -> RobotState:
    """The robot at rest in its nominal stance on ground of height ``z``."""
    R_WB = yaw_matrix(yaw)
    return RobotState(
        stamp=stamp,
        p_WB=np.array([x, y, z + robot.nominal_base_height]),
        rpy_WB=np.array([0.0, 0.0, yaw]),
        R_WB=R_WB,
        v_WB=np.zeros(3),
        w_WB=np.zeros(3),
        joint_positions=np.asarray(robot.nominal_joints),
        joint_velocities=np.zeros(12),
        joint_torques=np.zeros(12),
        contact_forces=np.tile([0.0, 0.0, robot.mass * GRAVITY / 4], (4, 1)),
        contacts=np.ones(4, dtype=bool),
    )


def state_at(robot, stance, stamp=0.0) -> RobotState:
    """The robot at rest with its feet on ``stance`` and its base at that stance's nominal pose."""
    rest = standing_state(robot, stamp=stamp)
    R_WB = rotation_from_rpy(np.asarray(stance.rpy_WB))
    centers = (stance.footholds + robot.foot_radius * stance.normals - stance.p_WB) @ R_WB
    solutions = [robot.leg_inverse_kinematics_B(leg, centers[leg]) for leg in range(4)]
    assert all(ok for _, ok in solutions), "a stance that the robot cannot take"
    joints = np.concatenate([q for q, _ in solutions])
    return replace(rest, p_WB=stance.p_WB, rpy_WB=stance.rpy_WB, R_WB=R_WB, joint_positions=joints)


def walk(robot, regions, goal, torso_config, foothold_config, start=None, max_plans=12):
    """Plans and jumps to the end of the plan until the goal is within 0.2 m; returns the plans and the last state."""
    state = standing_state(robot) if start is None else start
    plans = []
    for request_id in range(1, max_plans + 1):
        if np.hypot(*(state.p_WB[:2] - goal)) < 0.2:
            break
        path = search_torso_path(
            state.p_WB, state.rpy_WB[2], regions, goal, robot, torso_config,
            request_id=request_id, every_label=foothold_config.every_label,
        )  # fmt: skip
        plans.append(search_footholds(state, regions, path, robot, foothold_config))
        if not plans[-1].success:
            break
        state = state_at(robot, plans[-1].stances[-1])
    return plans, state
