"""The depth camera's geometry, checked on a rendered plane, and its noise."""

import numpy as np
import pytest
from pydrake.geometry import Box, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_description import CameraDescription, mount_camera
from quadpips_drake.sensing import depth_camera
from quadpips_drake.sensing.depth_camera import DepthCameraConfig, add_depth_camera, make_intrinsics
from quadpips_drake.sensing.depth_noise import DepthNoiseConfig, add_depth_noise
from quadpips_drake.sensing.depth_noise_system import DepthNoise

HEIGHT = 0.6


def render_floor(config: DepthCameraConfig):
    """Returns the depth image of a floor HEIGHT below a camera that looks 0.5 rad down, and its pose."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    floor = RigidTransform([0.0, 0.0, -0.5 - HEIGHT])
    plant.RegisterVisualGeometry(plant.world_body(), floor, Box(40, 40, 1), "floor", np.ones(4))
    plant.Finalize()
    mount = mount_camera(CameraDescription(pitch=0.5, yaw=0.3))
    camera = add_depth_camera(builder, scene_graph, SceneGraph.world_frame_id(), mount, config)
    builder.Connect(scene_graph.get_query_output_port(), camera.query_object_input_port())
    diagram = builder.Build()
    context = camera.GetMyContextFromRoot(diagram.CreateDefaultContext())
    pose = camera.body_pose_in_world_output_port().Eval(context).GetAsMatrix4()
    np.testing.assert_allclose(pose, mount.X_BC, atol=1e-12)
    return camera.depth_image_32F_output_port().Eval(context).data[:, :, 0].copy(), pose


@pytest.mark.parametrize("size", [(160, 120), (97, 64)])
def test_intrinsics_explain_the_image_to_the_pixel(size):
    config = DepthCameraConfig(width=size[0], height=size[1])
    depth, X_WC = render_floor(config)
    camera = make_intrinsics(config)
    v, u = np.mgrid[: camera.height, : camera.width]
    ray = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones_like(u)], axis=-1)
    with np.errstate(divide="ignore"):
        expected = -HEIGHT / (ray @ X_WC[2, :3])
    seen = (expected > 0) & (expected < config.max_range - 1e-3)
    np.testing.assert_allclose(depth[seen], expected[seen], rtol=1e-4)
    beyond = (expected < 0) | (expected > config.max_range + 1e-3)
    assert np.isinf(depth[beyond]).all()
    assert seen.mean() > 0.4


def test_default_camera_is_the_published_one():
    camera = make_intrinsics(DepthCameraConfig())
    assert (camera.width, camera.height) == (640, 480)
    assert camera.fx == camera.fy == pytest.approx(347.997, abs=1e-2)


@pytest.mark.parametrize("bad", [{"width": 0}, {"horizontal_fov": 3.5}, {"min_range": 2.0, "max_range": 1.0}])
def test_bad_camera(bad):
    with pytest.raises(UserInputError, match=f"{next(iter(bad))} must be "):
        DepthCameraConfig(**bad)


def test_missing_egl_names_the_package(monkeypatch):
    def no_library(name):
        raise OSError(f"{name}: cannot open shared object file")

    monkeypatch.setattr(depth_camera.ctypes, "CDLL", no_library)
    with pytest.raises(UserInputError, match="libegl1"):
        depth_camera.check_renderer()


def test_missing_driver_names_the_package(monkeypatch):
    monkeypatch.setattr(depth_camera, "_count_egl_devices", lambda egl: 0)
    with pytest.raises(UserInputError, match="libegl-mesa0"):
        depth_camera.check_renderer()


def make_depth():
    depth = np.full((120, 160), 2.0, np.float32)
    depth[:, :40] = 1.0
    depth[0, :], depth[1, :], depth[2, :] = 0.0, np.inf, np.nan
    return depth


def test_noise_off_changes_nothing():
    depth = make_depth()
    result = add_depth_noise(depth, 0.1, 3, DepthNoiseConfig())
    np.testing.assert_array_equal(result, depth)
    assert result is not depth


def test_noise_has_the_stated_size_and_spares_missing_pixels():
    config = DepthNoiseConfig(sigma=0.002, sigma_growth=0.004, dropout=0.1)
    depth = make_depth()
    noisy = add_depth_noise(depth, 0.1, 3, config)
    assert noisy.dtype == np.float32
    near, far = noisy[3:, :40] - 1.0, noisy[3:, 40:] - 2.0
    assert np.nanstd(near) == pytest.approx(0.006, rel=0.05)
    assert np.nanstd(far) == pytest.approx(0.018, rel=0.05)
    assert abs(np.nanmean(far)) < 1e-3
    assert np.isnan(noisy[3:]).mean() == pytest.approx(0.1, abs=0.01)
    kept = ~np.isnan(noisy[:3])
    np.testing.assert_array_equal(noisy[:3][kept], depth[:3][kept])


def test_noise_depends_on_seed_and_time_only():
    config = DepthNoiseConfig(sigma=0.01)
    depth = make_depth()
    once = add_depth_noise(depth, 0.1, 3, config)
    np.testing.assert_array_equal(once, add_depth_noise(depth, 0.1, 3, config))
    assert not np.array_equal(once, add_depth_noise(depth, 0.2, 3, config))
    assert not np.array_equal(once, add_depth_noise(depth, 0.1, 4, config))


def test_noise_system_passes_the_image_on():
    depth = make_depth()
    image = ImageDepth32F(160, 120)
    image.mutable_data[:, :, 0] = depth
    config = DepthNoiseConfig(sigma=0.01)
    system = DepthNoise(config, intrinsics=make_intrinsics(DepthCameraConfig(width=160, height=120)), seed=5)
    context = system.CreateDefaultContext()
    context.SetTime(0.7)
    system.GetInputPort("depth_image").FixValue(context, image)
    result = system.GetOutputPort("depth_image").Eval(context).data[:, :, 0]
    np.testing.assert_array_equal(result, add_depth_noise(depth, 0.7, 5, config))
    np.testing.assert_array_equal(system.GetOutputPort("depth_image").Eval(context.Clone()).data[:, :, 0], result)


@pytest.mark.parametrize("bad", [{"sigma": -0.1}, {"sigma_growth": 2.0}, {"dropout": 1.5}])
def test_bad_noise(bad):
    with pytest.raises(UserInputError, match=f"{next(iter(bad))} must be "):
        DepthNoiseConfig(**bad)
