"""What goes wrong on the controllers' side goes wrong when and as far as it is told to."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.errors import UserInputError
from quadpips_drake.faults.control_faults import ControlFaultConfig
from quadpips_drake.faults.failing_mpc_system import FailingMpc
from quadpips_drake.faults.raised_footholds_system import RaisedFootholds
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference


def test_the_solver_is_out_in_the_windows_and_not_otherwise():
    faults = ControlFaultConfig(outage_start=[0.1, 0.5], outage_duration=0.04)
    out = [round(time, 2) for time in np.arange(0.0, 0.7, 0.02) if faults.is_out(time)]
    assert out == [0.1, 0.12, 0.5, 0.52]
    assert not ControlFaultConfig().is_out(0.0)


def test_the_mpc_fails_during_an_outage():
    robot = load_robot("go2")
    mpc = FailingMpc(robot, faults=ControlFaultConfig(outage_start=[0.02], outage_duration=0.04))
    simulator = Simulator(mpc)
    context, fallbacks = simulator.get_mutable_context(), []
    mpc.GetInputPort("reference").FixValue(context, AbstractValue.Make(WholeBodyReference.empty()))
    for k in range(5):
        state = standing_state(robot, 0.02 * k)
        mpc.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(state))
        simulator.AdvanceTo(0.02 * k + 0.01)
        fallbacks.append(mpc.GetOutputPort("mpc_policy").Eval(context).fallbacks)
    assert fallbacks == [0, 1, 2, 2, 2]


def test_footholds_are_raised_and_nothing_else_is():
    footholds = (FootholdTarget(0, 0.1, 0.3, np.array([1.0, 2.0, 0.1]), np.array([0.0, 0.0, 1.0])),)
    reference = replace(WholeBodyReference.empty(), footholds=footholds, request_id=4)
    system = RaisedFootholds(-0.03)
    context = system.CreateDefaultContext()
    system.GetInputPort("reference").FixValue(context, AbstractValue.Make(reference))
    raised = system.GetOutputPort("raised_reference").Eval(context)
    np.testing.assert_allclose(raised.footholds[0].position, [1.0, 2.0, 0.07])
    assert raised.request_id == 4 and raised.footholds[0].touchdown_time == 0.3
    np.testing.assert_array_equal(reference.footholds[0].position, [1.0, 2.0, 0.1])


@pytest.mark.parametrize(
    ("setting", "message"), [({"terrain_height_error": 0.6}, "terrain_height_error"), ({"outage_duration": -1.0}, "outage")]
)
def test_bad_settings_are_refused(setting, message):
    with pytest.raises(UserInputError, match=message):
        ControlFaultConfig(**setting)
