"""The self-filter on rendered images: every pixel of the robot goes, nearly all of the ground stays."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.sensing.robot_shapes import load_robot_shapes
from quadpips_drake.sensing.self_filter import SelfFilterConfig, blank_own_body
from quadpips_drake.sensing.self_filter_system import SelfFilter
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.sensing import CameraIntrinsics


def find_own_body(depth, *arguments):
    """Which pixels of ``depth`` the filter blanks."""
    blanked = depth.copy()
    blank_own_body(blanked, *arguments)
    return np.isnan(blanked) & ~np.isnan(depth)


class View:
    """A robot on flat ground and what one of its cameras sees of it."""

    def __init__(self, robot_name: str, camera: str, pitch: float | None = None):
        config = StationConfig(camera_name=camera, camera_pitch=pitch)
        self.station = SimulationStation(load_robot(robot_name), load_terrain("flat"), config)
        self.robot = self.station.robot
        self.camera = self.robot.camera(camera)
        self.context = self.station.CreateDefaultContext()

    def render(self, q):
        """Returns the depth image and which pixels show something above the ground, with the feet's soles at z = 0."""
        plant = self.station.plant
        height = self.robot.foot_radius - self.robot.foot_positions_B(q)[:, 2].min()
        self.robot.set_state(plant, plant.GetMyMutableContextFromRoot(self.context), [0, 0, height], [0, 0, 0], q)
        depth = self.station.GetOutputPort("depth_image").Eval(self.context).data[:, :, 0].copy()
        k = self.station.camera_intrinsics
        v, u = np.mgrid[: k.height, : k.width]
        ray = np.stack([(u - k.cx) / k.fx, (v - k.cy) / k.fy, np.ones_like(u)], axis=-1)
        X_WC = self.station.GetOutputPort("camera_pose").Eval(self.context).GetAsMatrix4()
        seen = np.isfinite(depth) & (depth > 0)
        above_ground = np.where(seen, depth, 0.0) * (ray @ X_WC[2, :3]) + X_WC[2, 3] > 2e-3
        return depth, seen & above_ground, seen & ~above_ground

    def find_legs(self, depth, q):
        k = self.station.camera_intrinsics
        return find_own_body(depth, k, self.camera.X_BC, q, self.robot, SelfFilterConfig())


def stances(robot, rng, count, forward):
    """Nominal stance, then stances with each foot displaced by up to ``forward`` [m] ahead, sideways and up."""
    yield np.array(robot.nominal_joints)
    for _ in range(count):
        q = np.array(robot.nominal_joints)
        for leg in Leg:
            shift = rng.uniform([-0.05, -0.08, 0.0], [forward, 0.08, 0.12])
            angles, reached = robot.leg_inverse_kinematics_B(leg, robot.nominal_footholds_B[leg] + shift)
            if reached:
                q[leg.joints] = angles
        yield q


@pytest.mark.parametrize(
    ("robot", "camera", "pitch", "forward", "legs_visible"),
    [
        ("anymal_c", "front", None, 0.28, False),
        ("anymal_c", "front", None, 0.45, True),
        ("anymal_c", "front", 1.2, 0.35, True),
        ("anymal_c", "left", None, 0.25, True),
        ("go2", "front", None, 0.15, False),
        ("go2", "front", 0.785, 0.2, True),
        ("go2", "front", 1.2, 0.2, True),
    ],
)
def test_no_pixel_of_the_robot_survives_and_the_ground_stays(robot, camera, pitch, forward, legs_visible):
    view = View(robot, camera, pitch)
    rng = np.random.default_rng(4)
    leg_pixels, lost, ground_pixels = 0, 0, 0
    for q in stances(view.robot, rng, 12, forward):
        depth, legs, ground = view.render(q)
        mask = view.find_legs(depth, q)
        assert not (legs & ~mask).any(), "a pixel of the robot survived"
        leg_pixels += legs.sum()
        lost += (mask & ground).sum()
        ground_pixels += ground.sum()
    assert lost < 0.02 * ground_pixels
    assert (leg_pixels > 0) == legs_visible, "front cameras look past legs that do not reach far ahead"


def test_wrong_pixels_stay():
    """A point that hides behind a leg's outline, or in front of it, or is no measurement, is not the leg."""
    view = View("anymal_c", "left")
    q = np.array(view.robot.nominal_joints)
    depth, legs, _ = view.render(q)
    assert legs.any()
    for wrong in (depth + 0.3, np.full_like(depth, np.nan), np.full_like(depth, np.inf), np.zeros_like(depth)):
        assert (view.find_legs(wrong, q) & legs).sum() < 0.05 * legs.sum()


def test_margin_grows_with_noise():
    view = View("anymal_c", "left")
    q = np.array(view.robot.nominal_joints)
    depth, legs, _ = view.render(q)
    noisy = depth + np.random.default_rng(0).normal(0.0, 0.05, depth.shape).astype(np.float32)
    k, X_BC = view.station.camera_intrinsics, view.camera.X_BC
    tight = find_own_body(noisy, k, X_BC, q, view.robot, SelfFilterConfig(margin=0.01))
    wide = find_own_body(noisy, k, X_BC, q, view.robot, SelfFilterConfig(margin=0.01, margin_growth=0.5))
    assert not (tight & ~wide).any()
    assert (legs & wide).sum() > (legs & tight).sum()


def test_all_links_have_shapes():
    for robot in ("anymal_c", "go2"):
        shapes = load_robot_shapes(load_robot(robot))
        assert set(shapes.link) == set(range(13))


def test_system_blanks_and_passes_on():
    robot = load_robot("anymal_c")
    intrinsics = CameraIntrinsics(64, 48, 25.0, 25.0, 31.5, 23.5)
    image = ImageDepth32F(64, 48)
    image.mutable_data[:, :, 0] = 0.25
    for enabled in (True, False):
        system = SelfFilter(robot, SelfFilterConfig(enabled=enabled), intrinsics=intrinsics, camera="left")
        context = system.CreateDefaultContext()
        system.GetInputPort("depth_image").FixValue(context, image)
        system.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(nominal_state(robot)))
        result = system.GetOutputPort("depth_image").Eval(context).data[:, :, 0]
        expected = find_own_body(
            image.data[:, :, 0], intrinsics, robot.camera("left").X_BC, robot.nominal_joints, robot, SelfFilterConfig()
        )
        assert expected.any() and not expected.all()
        np.testing.assert_array_equal(np.isnan(result), expected & enabled)


def nominal_state(robot):
    state = RobotState.empty()
    fields = {**vars(state), "joint_positions": robot.nominal_joints}
    return type(state)(**fields)


@pytest.mark.parametrize("bad", [{"margin": -0.01}, {"margin_growth": 1.0}])
def test_bad_config(bad):
    with pytest.raises(UserInputError, match=f"{next(iter(bad))} must be "):
        SelfFilterConfig(**bad)
