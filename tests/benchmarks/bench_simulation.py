"""What nothing in this package can make quicker: the physics of a standing robot, and a depth image, by Drake alone.

Not part of the tests; on one core:

    taskset -c 0 pytest -s tests/benchmarks/bench_simulation.py

The printed table (Markdown) has the computing time of a simulated second of physics, by step and contact solver, and that of
one image of 640 x 480 pixels (all threads of the renderer together). Their sum at 30 images a second is the floor under the
real-time factor of a run.
"""

import time

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.primitives import ConstantVectorSource

from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain

SECONDS = 2.0
"""Of physics that is timed [s]."""
ROWS: list[str] = []


@pytest.fixture(scope="module", autouse=True)
def table():
    yield
    print("\n\n| what | terrain | ms |\n|---|---|---|\n" + "\n".join(ROWS))


def standing_station(terrain: str, **settings):
    """The simulator of a robot that stands, its drives holding the stance."""
    robot, world = load_robot("anymal_c"), load_terrain(terrain)
    builder = DiagramBuilder()
    station = builder.AddSystem(SimulationStation(robot, world, StationConfig(**settings)))
    for name, value in (
        ("desired_joint_state", np.r_[robot.nominal_joints, np.zeros(12)]),
        ("feedforward_torque", np.zeros(12)),
    ):
        source = builder.AddSystem(ConstantVectorSource(value))
        builder.Connect(source.get_output_port(), station.GetInputPort(name))
    simulator = Simulator(builder.Build())
    station.set_initial_state(simulator.get_mutable_context(), *world.start)
    simulator.AdvanceTo(0.5)
    return simulator, station


@pytest.mark.parametrize("terrain", ["flat", "stepping_stones"])
@pytest.mark.parametrize(("time_step", "solver"), [(0.001, "sap"), (0.001, "lagged"), (0.002, "sap")])
def test_physics(terrain, time_step, solver):
    simulator, _ = standing_station(terrain, time_step=time_step, contact_approximation=solver)
    begun, start = simulator.get_context().get_time(), time.process_time()
    simulator.AdvanceTo(begun + SECONDS)
    cost = (time.process_time() - start) / SECONDS
    assert simulator.get_context().get_time() > begun
    ROWS.append(
        f"| a simulated second of physics, steps of {1e3 * time_step:g} ms, {solver} | {terrain} | {1e3 * cost:.0f} |"
    )


@pytest.mark.parametrize("terrain", ["flat", "stairs", "stepping_stones", "sparse_stones"])
def test_image(terrain):
    simulator, station = standing_station(terrain)
    context, times = simulator.get_mutable_context(), []
    plant_context = station.plant.GetMyMutableContextFromRoot(context)
    port = station.GetOutputPort("depth_image")
    for _ in range(40):
        positions = station.plant.GetPositions(plant_context).copy()
        positions[4] += 1e-3
        station.plant.SetPositions(plant_context, positions)
        start = time.process_time()
        image = port.Eval(station.GetMyContextFromRoot(context))
        times.append(time.process_time() - start)
    assert np.isfinite(image.data).any()
    ROWS.append(f"| an image | {terrain} | {1e3 * np.median(times):.1f} |")
