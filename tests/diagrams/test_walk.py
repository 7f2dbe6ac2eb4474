"""Walks in the station: pushes, model errors, and a change of gait in mid-walk."""

import numpy as np
import pytest

from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.diagrams.walk import WalkConfig
from quadpips_drake.faults.model_errors import ModelErrorConfig
from quadpips_drake.faults.push_system import Push, force_at
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trials.walk_trial import WalkTrial, WalkTrialConfig


def _station(**errors):
    robot = load_robot("go2")
    station = SimulationStation(robot, load_terrain("flat"), StationConfig(model_error=ModelErrorConfig(**errors)))
    context = station.CreateDefaultContext()
    station.set_initial_state(context, 0.0, 0.0, 0.0)
    return robot, station, context


def test_payload_and_base_mass_are_in_the_plant():
    robot, station, context = _station(payload=2.0, base_mass_factor=1.1)
    total = station.plant.CalcTotalMass(station.plant.GetMyContextFromRoot(context))
    assert total == pytest.approx(robot.mass + 2.0 + 0.1 * robot.tree.link_mass[0])


def test_late_drives_hold_the_stance_until_the_first_command_arrives():
    robot, station, context = _station(actuator_delay=0.01)
    state = station._delays["desired_joint_state"]
    desired = state.get_output_port().Eval(state.GetMyContextFromRoot(context))
    assert desired[:12] == pytest.approx(robot.nominal_joints, abs=0.02)


def test_pushes_add_up_while_they_last():
    pushes = [Push([1.0, 0.0, 0.0], 1.0, 0.5), Push([0.0, 2.0, 0.0], 1.2, 0.1)]
    assert force_at(pushes, 0.99) == pytest.approx([0.0, 0.0, 0.0])
    assert force_at(pushes, 1.25) == pytest.approx([1.0, 2.0, 0.0])
    assert force_at(pushes, 1.5) == pytest.approx([0.0, 0.0, 0.0])


def test_a_push_a_load_and_a_change_of_gait_are_survived():
    stages = WalkConfig(station=StationConfig(model_error=ModelErrorConfig(payload=1.0, friction=0.6)))
    config = WalkTrialConfig(
        robot="go2",
        velocity=[0.2, 0.0, 0.0],
        settle_time=0.1,
        duration=3.0,
        changes=[WalkCommand(1.5, "static_walk", [0.1, 0.0, 0.0])],
        pushes=[Push([0.0, 40.0, 0.0], 0.9, 0.1)],
        stages=stages,
    )
    trial = WalkTrial(config)
    assert trial.run().reason == "upright", trial.verdict.detail
    arrays = trial.log.arrays()
    before, after = (arrays["v_WB"][np.searchsorted(arrays["time"], t - 1e-6), 1] for t in (0.9, 1.0))
    assert 0.1 < after - before < 4.0 / trial.robot.mass + 0.05
    airborne = (~arrays["contacts"][arrays["time"] > 2.1]).sum(axis=1)
    assert np.median(airborne) == 1, "static_walk swings one foot at a time"
