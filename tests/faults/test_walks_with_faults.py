"""Closed loop: a trot goes on while the MPC's solver fails for 100 ms in mid-stride, and with late solutions."""

import numpy as np
import pytest

from quadpips_drake.faults.control_faults import ControlFaultConfig
from quadpips_drake.trials.walk_trial import WalkTrial, WalkTrialConfig
from quadpips_drake.values.whole_body_command import FootMode

_PERIODS = 5
"""Updates in 100 ms at 50 Hz."""


def _trot(latency=0.0, **faults):
    config = WalkTrialConfig(velocity=[0.3, 0.0, 0.0], settle_time=0.1, duration=2.2)
    config.stages.tracking.mpc.latency = latency
    config.stages.tracking.faults = ControlFaultConfig(**faults)
    trial = WalkTrial(config)
    verdict = trial.run()
    return trial, verdict


@pytest.mark.parametrize("fault", [1.0, 1.1])
def test_a_failing_solver_in_mid_stride(fault):
    trial, verdict = _trot(outage_start=[fault], outage_duration=0.1)
    assert verdict.reason == "upright", verdict.detail
    assert trial.result().fallbacks["mpc"] == _PERIODS
    assert np.abs(trial.log.arrays()["rpy_WB"][:, :2]).max() < 0.12


def test_late_solutions():
    trial, verdict = _trot(latency=0.02)
    assert verdict.reason == "upright", verdict.detail
    assert np.abs(trial.log.arrays()["rpy_WB"][:, :2]).max() < 0.12


@pytest.mark.parametrize(("error", "mode"), [(0.03, FootMode.SEARCH), (-0.03, FootMode.EARLY)])
def test_ground_that_is_not_where_it_is_believed_to_be(error, mode):
    trial, verdict = _trot(terrain_height_error=error)
    assert verdict.reason == "upright", verdict.detail
    assert np.mean(trial.log.arrays()["foot_modes"] == mode) > 0.02, "the error must have been felt"
