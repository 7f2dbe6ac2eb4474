"""Closed loop in the station: both robots trot a short way and come to a stand."""

import numpy as np
import pytest

from quadpips_drake.control.gaits import load_gait
from quadpips_drake.diagrams.tracking_module import make_tracking_module
from quadpips_drake.diagrams.walk import WalkConfig, simulate_walk
from quadpips_drake.robots.robot_model import load_robot
from quadpips_drake.terrain.library import load_terrain


def test_ports_have_their_names():
    module = make_tracking_module(load_robot("go2"))
    inputs = [module.get_input_port(i).get_name() for i in range(module.num_input_ports())]
    outputs = [module.get_output_port(i).get_name() for i in range(module.num_output_ports())]
    assert inputs == ["robot_state", "reference", "abort"]
    assert outputs == ["feedforward_torque", "desired_joint_state", "mpc_policy", "wbc_status", "safety_status"]


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_a_short_trot(name):
    robot = load_robot(name)
    config = WalkConfig(settle_time=0.1, stop_time=0.8)
    log = simulate_walk(robot, load_terrain("flat"), load_gait("trot"), [0.3, 0.0, 0.0], 2.4, config)
    assert log.fell == ""
    assert log.fallbacks == {"centroidal_mpc": 0, "whole_body_control": 0}
    assert 0.15 < log.p_WB[-1, 0] - log.p_WB[0, 0] < 0.6
    assert np.abs(log.rpy_WB[:, :2]).max() < 0.1
    assert np.abs(log.p_WB[:, 2] - robot.nominal_base_height).max() < 0.1 * robot.nominal_base_height
