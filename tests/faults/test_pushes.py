"""Pushes: added to a simulation that goes on, and during a run with a planner."""

import numpy as np
import pytest

from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.faults.push_system import Push, PushSource
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trials.trial import Trial, TrialConfig


def forces_of(source, context) -> list:
    return [push.F_Bq_W.translational() for push in source.get_output_port().Eval(context)]


def test_a_push_is_added_while_others_go_on():
    station = SimulationStation(load_robot("go2"), load_terrain("flat"), StationConfig())
    source = PushSource([Push([10.0, 0.0, 0.0], 1.0, 1.0)], station.plant.GetBodyByName("base"))
    context, other = source.CreateDefaultContext(), source.CreateDefaultContext()
    context.SetTime(1.2)
    assert forces_of(source, context) == [pytest.approx([10.0, 0.0, 0.0])]
    source.add(context, Push([0.0, 5.0, 0.0], 1.2, 0.5))
    assert forces_of(source, context) == [pytest.approx([10.0, 5.0, 0.0])]
    context.SetTime(2.5)
    assert forces_of(source, context) == []
    other.SetTime(1.2)
    assert forces_of(source, other) == [pytest.approx([10.0, 0.0, 0.0])], "the pushes are the context's, not the system's"


def test_a_push_moves_the_robot_of_a_planner():
    config = TrialConfig(robot="go2", terrain="flat", duration=0.3, pushes=[Push([0.0, 60.0, 0.0], 0.1, 0.1)])
    trial = Trial(config)
    assert trial.run().reason == "timeout", trial.verdict.detail
    log = trial.log.arrays()
    before, after = (log["v_WB"][np.searchsorted(log["time"], t - 1e-6), 1] for t in (0.1, 0.2))
    assert abs(before) < 0.05
    assert 0.05 < after - before < 6.0 / trial.robot.mass + 0.05
    np.testing.assert_allclose([trial.force_on_base(t) for t in (0.05, 0.15)], [[0.0, 0.0, 0.0], [0.0, 60.0, 0.0]])
    assert log["push"][:, 1].max() == 60.0 and np.count_nonzero(log["push"][:, 1]) == 10
