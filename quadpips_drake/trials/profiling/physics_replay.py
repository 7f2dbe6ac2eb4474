"""What the physics of a trial costs by itself: a part that no profiler of Python can see inside Drake's simulation loop."""

import time

import numpy as np
from pydrake.math import RollPitchYaw
from pydrake.systems.analysis import Simulator

from quadpips_drake.diagrams.simulation_station import SimulationStation

MOMENTS = 50
"""Of the log, from which physics is repeated."""
STRETCH = 0.02
"""Simulated from each of them [s]."""


def physics_load(station: SimulationStation, arrays: dict[str, np.ndarray]) -> float:
    """Returns the computing time of the physics, seconds per simulated second.

    A station of its own, with nobody who reads its sensors, is set to moments of the log, one after the other, and goes on
    from each with the drives' torques of that moment.

    Args:
        station: that of the trial.
        arrays: of the trial's log.
    """
    alone = SimulationStation(station.robot, station.terrain, station.config)
    simulator = Simulator(alone)
    context = simulator.get_mutable_context()
    torque, target = alone.GetInputPort("feedforward_torque"), alone.GetInputPort("desired_joint_state")
    torque.FixValue(context, np.zeros(torque.size()))
    target.FixValue(context, np.zeros(target.size()))
    simulator.Initialize()
    elapsed, chosen = 0.0, np.unique(np.linspace(0, len(arrays["time"]) - 1, MOMENTS).astype(int))
    for k in chosen:
        q, v = arrays["joint_positions"][k], arrays["joint_velocities"][k]
        attitude = RollPitchYaw(arrays["rpy_WB"][k]).ToQuaternion().wxyz()
        state = np.concatenate((attitude, arrays["p_WB"][k], q, arrays["w_WB"][k], arrays["v_WB"][k], v))
        alone.plant.SetPositionsAndVelocities(alone.plant.GetMyMutableContextFromRoot(context), state)
        torque.FixValue(context, arrays["joint_torques"][k])
        target.FixValue(context, np.concatenate((q, v)))
        alone.bring_ground_near(context)
        start = time.perf_counter()
        simulator.AdvanceTo(context.get_time() + STRETCH)
        elapsed += time.perf_counter() - start
    return elapsed / (STRETCH * len(chosen))
