"""RobotModel against Drake's own kinematics, published figures and itself."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable

from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_description import CameraDescription, RobotDescription
from quadpips_drake.robots.robot_library import load_robot, robot_names
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.legs import Leg
from tests.source_tree import ROOT, files


@pytest.fixture(scope="module", params=robot_names())
def robot(request):
    return load_robot(request.param)


def random_joints(robot, rng):
    lower = np.maximum(robot.position_limits_lower, robot.nominal_joints - 1.3)
    upper = np.minimum(robot.position_limits_upper, robot.nominal_joints + 1.3)
    return rng.uniform(lower, upper)


def test_names():
    assert robot_names() == ["anymal_c", "go2"]
    with pytest.raises(UserInputError, match=r"unknown robot 'spot'; known: anymal_c, go2"):
        load_robot("spot")
    assert load_robot("go2") is load_robot("go2")


def test_feet_at_published_places():
    """Foot frames at OCS2's default stance; the centre of ANYmal's foot lies 0.0225 m above its foot frame."""
    anymal, go2 = load_robot("anymal_c"), load_robot("go2")
    shank = 1 + Leg.LF.joints.stop - 1
    for leg in Leg:
        foot = anymal.nominal_footholds_B[leg]
        rotation = anymal.link_poses_B(anymal.nominal_joints)[0][shank + 3 * (leg - Leg.LF)]
        expected = np.array([leg.fore * 0.3677, leg.side * 0.1612, -0.5729])
        np.testing.assert_allclose(foot - rotation @ [0.0, 0.0, 0.0225], expected, atol=1e-4)
        # The centre of Go2's foot lies 0.002 m behind its foot frame, along the turned shank.
        expected = np.array([leg.fore * 0.1934, leg.side * 0.142, -0.3203])
        np.testing.assert_allclose(go2.nominal_footholds_B[leg], expected, atol=2.1e-3)
    assert anymal.nominal_base_height == pytest.approx(0.5518 + 0.03, abs=1e-4)
    assert go2.nominal_base_height == pytest.approx(0.342, abs=3e-3)


def test_feet_in_the_world_belong_to_the_pose_of_the_base(robot):
    p_WB, rpy = np.array([1.0, -2.0, 0.7]), np.array([0.1, -0.2, 2.0])
    X_WB = RigidTransform(RollPitchYaw(rpy), p_WB)
    state = replace(standing_state(robot), p_WB=p_WB, rpy_WB=rpy, R_WB=X_WB.rotation().matrix())
    feet = robot.foot_positions_W(state)
    np.testing.assert_allclose(feet, X_WB.multiply(robot.nominal_footholds_B.T).T, atol=1e-12)
    np.testing.assert_allclose(feet - robot.soles_W(feet), np.tile([0.0, 0.0, robot.foot_radius], (4, 1)), atol=1e-12)
    np.testing.assert_allclose(robot.soles_W(feet[2]), robot.soles_W(feet)[2])


def test_feet_are_put_into_the_world_in_one_place():
    elsewhere = [
        path.relative_to(ROOT).as_posix()
        for path in files("*.py")
        if path.relative_to(ROOT).parts[0] in ("quadpips_drake", "diagrams") and path.parent.name != "robots"
        if "foot_positions_B" in path.read_text(encoding="utf-8")
    ]
    assert not elsewhere, "foot_positions_W and foot_positions_at are there for that"


def test_kinematics_agree_with_drake(robot):
    plant = MultibodyPlant(time_step=1e-3)
    robot.add_to_plant(plant)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    rng = np.random.default_rng(1)
    base = plant.GetBodyByName("base").body_frame()
    for _ in range(10):
        q = random_joints(robot, rng)
        p_WB, rpy = rng.uniform(-1, 1, 3), rng.uniform(-0.5, 0.5, 3)
        robot.set_state(plant, context, p_WB, rpy, q)
        feet, jacobians = robot.foot_positions_B(q), robot.foot_jacobians_B(q)
        for leg in Leg:
            shank = plant.GetBodyByName(f"{leg.name}_SHANK").body_frame()
            p_BF = plant.CalcPointsPositions(context, shank, robot.tree.foot_offset[leg], base).ravel()
            np.testing.assert_allclose(feet[leg], p_BF, atol=1e-12)
            jacobian = plant.CalcJacobianTranslationalVelocity(
                context, JacobianWrtVariable.kV, shank, robot.tree.foot_offset[leg], base, base
            )
            np.testing.assert_allclose(jacobians[leg], jacobian[:, 6:][:, leg.joints], atol=1e-12)
    X_WB: RigidTransform = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("base"))
    np.testing.assert_allclose(X_WB.translation(), p_WB)


def test_inverse_kinematics_round_trip(robot):
    rng = np.random.default_rng(2)
    for _ in range(300):
        q = random_joints(robot, rng)
        feet = robot.foot_positions_B(q)
        for leg in Leg:
            near, reached = robot.leg_inverse_kinematics_B(leg, feet[leg], q[leg.joints])
            assert reached
            np.testing.assert_allclose(near, q[leg.joints], atol=1e-6)
            any_guess, reached = robot.leg_inverse_kinematics_B(leg, feet[leg])
            assert reached
            again = q.copy()
            again[leg.joints] = any_guess
            np.testing.assert_allclose(robot.foot_positions_B(again)[leg], feet[leg], atol=1e-9)
            assert (any_guess >= robot.position_limits_lower[leg.joints] - 1e-9).all()
            assert (any_guess <= robot.position_limits_upper[leg.joints] + 1e-9).all()


def test_out_of_reach_is_said_and_points_the_right_way(robot):
    for leg in Leg:
        hip = robot.hip_positions_B[leg]
        for direction in ([0.0, 0.0, -1.0], [0.6, 0.0, -0.8], [-0.6, 0.0, -0.8]):
            far = robot.nominal_footholds_B[leg] + np.array(direction)
            angles, reached = robot.leg_inverse_kinematics_B(leg, far)
            assert not reached
            assert np.isfinite(angles).all()
            q = robot.nominal_joints.copy()
            q[leg.joints] = angles
            towards = robot.foot_positions_B(q)[leg] - hip
            assert towards @ direction > 0.6 * np.linalg.norm(towards)
        _, reached = robot.leg_inverse_kinematics_B(leg, hip)
        assert not reached, "a foot in the hip's axis"


def test_front_camera_looks_ahead_and_down(robot):
    X_BC = robot.camera().X_BC
    np.testing.assert_allclose(X_BC[:3, :3] @ X_BC[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(X_BC[:3, :3]) == pytest.approx(1.0)
    right, down, forward = X_BC[:3, :3].T
    assert forward[0] > 0.8 and forward[2] < 0
    assert right[1] == pytest.approx(-1.0) and down[2] < -0.8
    steeper = robot.with_camera_pitch("front", np.pi / 4).camera().X_BC
    np.testing.assert_allclose(steeper[:3, 2], [np.sqrt(0.5), 0, -np.sqrt(0.5)], atol=1e-12)
    np.testing.assert_array_equal(steeper[:3, 3], X_BC[:3, 3])


def test_anymal_has_four_cameras():
    forward = {mount.name: mount.X_BC[:3, 2] for mount in load_robot("anymal_c").camera_mounts}
    expected = {"front": (1, 0), "rear": (-1, 0), "left": (0, 1), "right": (0, -1)}
    assert set(forward) == set(expected)
    for name, (x, y) in expected.items():
        np.testing.assert_allclose(forward[name], [0.866 * x, 0.866 * y, -0.5], atol=1e-4)
    with pytest.raises(UserInputError, match="unknown camera 'top'; known: front, left, rear, right"):
        load_robot("anymal_c").camera("top")


def test_bad_description():
    with pytest.raises(UserInputError, match="nominal_joints must have 12 items, not 3"):
        RobotDescription(nominal_joints=[0.0, 0.0, 0.0])
    with pytest.raises(UserInputError, match="'front'"):
        RobotDescription(cameras=[CameraDescription(name="rear")])


def test_arrays_are_read_only(robot):
    with pytest.raises(ValueError, match="read-only"):
        robot.nominal_joints[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        robot.tree.link_mass[0] = 1.0
