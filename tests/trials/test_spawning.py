"""What appears during a trial: from its time on seen and touched, and told in the result."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.sensing.depth_camera import DepthCameraConfig
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.trials.loading import load_config
from quadpips_drake.trials.spawning.spawner import FOOTHOLD_LEAD, Spawner, parse_spawns
from quadpips_drake.trials.trial import run_trial
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from quadpips_drake.values.regions import GroundHeights

FLAT = load_terrain("flat")
NOTHING = WholeBodyReference.empty()


@pytest.fixture
def world():
    """A Go2 that stands at the origin, a spawner for the texts, and the context of all."""

    def make(*texts):
        spawns = parse_spawns(list(texts), 10.0)
        elements = tuple(element for spawn in spawns for element in spawn.elements)
        robot = load_robot("go2")
        station = SimulationStation(
            robot, FLAT, StationConfig(camera=DepthCameraConfig(width=64, height=48)), appearing=elements
        )
        context = station.CreateDefaultContext()
        station.set_initial_state(context, 0.0, 0.0, 0.0)
        diagram = SimpleNamespace(
            station=station, robot=robot, regions=station, GetOutputPort=lambda name: station.GetOutputPort(name)
        )
        return Spawner(spawns, diagram, FLAT), station, context

    return make


def image_of(station, context) -> np.ndarray:
    return np.array(station.GetOutputPort("depth_image").Eval(context).data)


def test_the_camera_sees_an_element_from_its_time_on(world):
    spawner, station, context = world("box:0.3,0.3,0.2@1.0,0@4")
    before = image_of(station, context)
    assert not spawner.advance(context, 3.99, NOTHING) and spawner.appeared() == []
    np.testing.assert_array_equal(image_of(station, context), before)
    _, plain, other = world()
    np.testing.assert_array_equal(image_of(plain, other), before)
    assert spawner.advance(context, 4.0, NOTHING)
    now = image_of(station, context)
    seen = np.isfinite(before) & np.isfinite(now)
    assert (before[seen] - now[seen]).max() > 0.1
    assert GroundTruth(spawner.terrain).height(1.0, 0.0) == pytest.approx(0.2)
    assert not spawner.advance(context, 5.0, NOTHING), "it is there already"


def test_the_robot_touches_it_from_its_time_on():
    spawns = parse_spawns(["box:0.3,0.3,0.2@0,0,1.0@0.1"], 1.0)
    robot = load_robot("go2")
    config = StationConfig(camera=DepthCameraConfig(width=64, height=48))
    station = SimulationStation(robot, FLAT, config, appearing=spawns[0].elements)
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    station.set_initial_state(context, 0.0, 0.0, 0.0)
    for name, size in (("feedforward_torque", 12), ("desired_joint_state", 24)):
        station.GetInputPort(name).FixValue(context, np.zeros(size))
    diagram = SimpleNamespace(station=station, robot=robot, regions=station, GetOutputPort=station.GetOutputPort)
    spawner = Spawner(spawns, diagram, FLAT)
    simulator.AdvanceTo(0.1)
    spawner.watch(context, 0.1)
    spawner.advance(context, 0.1, NOTHING)
    box = spawns[0].elements[0].X_WE.copy()
    spawner.watch(context, 0.1)
    assert spawner.plain() == [{"what": spawns[0].text, "at": 0.1, "noticed": None, "touched": False, "touched_by": []}]
    box[2, 3] = 0.35  # from far above to where the body is
    station.let_appear(context, 0, box)
    simulator.AdvanceTo(0.2)
    spawner.watch(context, 0.2)
    assert spawner.plain()[0]["touched"] and "base" in spawner.plain()[0]["touched_by"]


def test_nothing_appears_inside_the_robot(world):
    spawner, _, context = world("box:0.3,0.3,0.2@0.2,0.1@1")
    with pytest.raises(UserInputError, match=r"the robot is there at 1\.00 s"):
        spawner.advance(context, 1.0, NOTHING)
    spawner, _, context = world("box:0.3,0.3,0.2@200,0@1")
    with pytest.raises(UserInputError, match=r"there is no ground at \(200, 0\)"):
        spawner.advance(context, 1.0, NOTHING)


def test_it_appears_on_the_next_foothold_with_time_and_room_enough(world):
    spawner, _, context = world("box:0.2,0.2,0.15@foothold@4")
    assert not spawner.advance(context, 4.0, NOTHING), "there is no foothold yet"
    radius, up = load_robot("go2").foot_radius, np.array([0.0, 0.0, 1.0])

    def foothold(x, touchdown):
        return FootholdTarget(Leg.LF, touchdown - 0.4, touchdown, np.array([x, 0.14, radius]), up)

    places = [
        foothold(0.6, 4.0 + FOOTHOLD_LEAD),
        foothold(0.2, 5.7),
        foothold(0.76, 5.8),
        foothold(1.0, 6.0),
        foothold(1.4, 6.3),
    ]
    reference = WholeBodyReference(
        4.0, 1, np.zeros(0), np.zeros((0, 24)), np.zeros((0, 24)), NOTHING.schedule, tuple(places)
    )
    assert spawner.advance(context, 4.1, reference)  # too soon; where the robot stands; too near to the first
    np.testing.assert_allclose(spawner.terrain.elements[-1].X_WE[:3, 3], [1.0, 0.14, 0.075])
    assert spawner.plain()[0]["at"] == 4.1


def test_it_is_noticed_when_the_map_shows_it(world):
    spawner, _, context = world("box:0.3,0.3,0.2@1.0,0@4")
    spawner.advance(context, 4.0, NOTHING)
    (spawned,) = spawner._all
    for top, is_noticed in ((np.nan, False), (0.05, False), (0.15, True)):
        heights = np.zeros((100, 100), np.float32)
        heights[45:55, 45:55] = top
        known = GroundHeights(4.0, np.array([0.5, -0.5]), 0.01, heights)
        assert spawned.is_shown_by(known) == is_noticed
    assert not spawned.is_shown_by(GroundHeights.empty())


@pytest.mark.parametrize(
    ("spawn", "words"), [("box:0.3,0.3,0.2@1,0@120", "before the end of the trial"), ("box@1", "something is missing")]
)
def test_a_configuration_with_nonsense_is_refused(spawn, words):
    with pytest.raises(UserInputError, match=words):
        load_config("go2", terrain="flat", spawn=[spawn])


def test_a_run_tells_what_appeared(tmp_path):
    config = load_config(
        "go2",
        terrain="flat",
        duration=0.3,
        spawn=["box:0.3,0.3,0.2@1,0@0.1", "sphere:0.1@2,0@0.29", "sphere:0.1@foothold@0"],
    )
    result = run_trial(config, tmp_path / "run", recording=False)
    told = json.loads((tmp_path / "run" / "result.json").read_text())["spawned"]
    assert told == result.spawned and [entry["at"] for entry in told] == [0.1, 0.29, None]
    again = run_trial(load_config(file=tmp_path / "run" / "config.yaml"), tmp_path / "again", recording=False)
    assert again.spawned == told
    bad = load_config("go2", terrain="flat", duration=0.3, spawn=["box:0.3,0.3,0.2@0.1,0@0.1"])
    with pytest.raises(UserInputError, match="the robot is there"):
        run_trial(bad, tmp_path / "bad", recording=False)
    assert json.loads((tmp_path / "bad" / "result.json").read_text())["reason"] == "error"
