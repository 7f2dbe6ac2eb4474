"""Plots of a log, and rendered pictures."""

import numpy as np
import pytest

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.values.legs import Leg
from quadpips_drake.visualization import plots, snapshot
from quadpips_drake.visualization.meshes import plan_meshes
from tests.visualization import examples


@pytest.fixture(scope="module")
def robot():
    return load_robot("anymal_c")


def walking_log(robot) -> dict:
    """Two seconds at 50 Hz; diagonal pairs swing in turn."""
    time = np.arange(0, 2, 0.02)
    n = len(time)
    base = np.column_stack((-1 + 0.3 * time, 0 * time, np.full(n, robot.nominal_base_height)))
    contacts = np.ones((n, 4), bool)
    contacts[:, [Leg.LF, Leg.RH]] = (time % 1.0 > 0.4)[:, None]
    contacts[:, [Leg.RF, Leg.LH]] = (time % 1.0 < 0.5)[:, None]
    feet = robot.nominal_footholds_B + base[:, None]
    feet[:, :, 2] += 0.08 * ~contacts
    return {
        "time": time,
        "p_WB": base,
        "rpy_WB": np.zeros((n, 3)),
        "joint_positions": np.tile(robot.nominal_joints, (n, 1)),
        "joint_torques": np.ones((n, 12)),
        "contacts": contacts,
        "contact_forces": np.tile([0.0, 0.0, 120.0], (n, 4, 1)),
        "foot_positions": feet,
        "reference_p_WB": base + 0.01,
        "foothold_leg": np.arange(4),
        "foothold_position": feet[0],
    }


def test_plots_are_written(robot, tmp_path):
    log = walking_log(robot)
    paths = plots.save_plots(log, tmp_path / "plots", terrain=load_terrain("stepping_stones"), robot=robot)
    assert [path.name for path in paths] == ["path.png", "base.png", "feet.png", "torques.png"]
    assert all(path.stat().st_size > 10_000 for path in paths)
    optional = ("contact_forces", "reference_p_WB", "foothold_leg", "foothold_position")
    for key in optional:
        del log[key]
    plots.save_plots(log, tmp_path / "less")


def test_touchdowns_are_found(robot):
    log = walking_log(robot)
    touchdowns = plots.touchdown_positions(log, Leg.LF)
    assert len(touchdowns) == 2
    np.testing.assert_allclose(touchdowns[:, 2], robot.foot_radius)


def test_robot_and_overlays_are_in_the_picture(robot):
    terrain = load_terrain("stepping_stones")
    log = walking_log(robot)
    bare = snapshot.SnapshotRenderer(robot, terrain, width=320, height=180)
    first, last = bare.render_log(log, [0.0, 1.9])
    assert first.shape == (180, 320, 3)
    assert np.abs(first.astype(int) - last).max() > 50, "the camera follows, the ground moves past"
    red = (first[..., 0] > 80) & (first[..., 1] < 50)
    assert red.sum() > 50, "ANYmal's red shell"
    overlay = plan_meshes.region_mesh(examples.regions(0.0))
    view = snapshot.look_at([0.4, 0.0, 2.0], [0.4, 0.0, 0.0])
    drawn = snapshot.SnapshotRenderer(robot, terrain, overlays=[overlay], width=320, height=180)
    pose = (log["p_WB"][0] - [2, 0, 0], log["rpy_WB"][0], log["joint_positions"][0])
    changed = np.abs(drawn.render(*pose, view).astype(int) - bare.render(*pose, view)).max(axis=-1) > 40
    assert changed.mean() > 0.02
    assert snapshot.film_strip([first, last, first], columns=2).shape == (180 * 2 + 6, 320 * 2 + 6, 3)


def test_chase_camera_sees_the_robot_in_its_middle():
    view = snapshot.ChaseView(ahead=0.0)
    X_WC = view.X_WC(np.array([1.0, 2.0, 0.7]), yaw=0.5)
    target = X_WC.inverse() @ np.array([1.0, 2.0, 0.5])
    np.testing.assert_allclose(target, [0, 0, view.distance], atol=1e-9)
    assert X_WC.rotation().matrix()[2, 1] < 0, "image down is down"


def test_snapshot_at_the_start_is_written(robot, tmp_path):
    snapshot.render_snapshot(robot, load_terrain("stairs"), tmp_path / "start.png")
    assert (tmp_path / "start.png").stat().st_size > 5_000
    with pytest.raises(OSError, match="cannot write"):
        snapshot.save_picture(np.zeros((4, 4, 3), np.uint8), tmp_path / "missing" / "a.png")
