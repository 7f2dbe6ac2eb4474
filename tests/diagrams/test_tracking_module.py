"""Closed loop in the station: both robots trot a short way and come to a stand."""

import numpy as np
import pytest

from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.control.whole_body.whole_body_config import WbcConfig
from quadpips_drake.diagrams.tracking_module import TrackingConfig, TrackingModule
from quadpips_drake.faults.control_faults import ControlFaultConfig
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trials.walk_trial import WalkTrial, WalkTrialConfig


def test_ports_have_their_names():
    module = TrackingModule(load_robot("go2"))
    inputs = [module.get_input_port(i).get_name() for i in range(module.num_input_ports())]
    outputs = [module.get_output_port(i).get_name() for i in range(module.num_output_ports())]
    assert inputs == ["robot_state", "reference", "abort", "signed_distance"]
    assert outputs == ["feedforward_torque", "desired_joint_state", "mpc_policy", "wbc_status", "safety_status"]


@pytest.mark.parametrize("faults", [ControlFaultConfig(), ControlFaultConfig(outage_start=[1.0])])
def test_both_controllers_agree_on_early_touch_downs(faults):
    wbc = WbcConfig(early_contact_phase=0.75)
    module = TrackingModule(load_robot("go2"), TrackingConfig(wbc=wbc, faults=faults))
    assert module.GetSubsystemByName("centroidal_mpc")._mpc._early_contact_phase == 0.75


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_a_short_trot(name):
    stand = WalkCommand(1.6, "stance")
    config = WalkTrialConfig(robot=name, velocity=[0.3, 0.0, 0.0], settle_time=0.1, duration=2.4, changes=[stand])
    trial = WalkTrial(config)
    assert trial.run().reason == "upright", trial.verdict.detail
    assert trial.result().fallbacks == {"mpc": 0, "wbc": 0}
    log, height = trial.log.arrays(), trial.robot.nominal_base_height
    assert 0.15 < log["p_WB"][-1, 0] - log["p_WB"][0, 0] < 0.6
    assert np.abs(log["rpy_WB"][:, :2]).max() < 0.1
    assert np.abs(log["p_WB"][:, 2] - height).max() < 0.1 * height
