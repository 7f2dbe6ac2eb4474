"""The station: same ports for every robot, stands still, measures what is true, repeats itself."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from quadpips_drake.diagrams.observed_station import ObservedStation
from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.errors import UserInputError
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.robot_library import load_robot, robot_names
from quadpips_drake.sensing.contact_sensing import links_touching_each_other, touching_links
from quadpips_drake.sensing.depth_camera import DepthCameraConfig
from quadpips_drake.sensing.imu_system import ImuConfig
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.standing_pose import standing_pose
from quadpips_drake.terrain.terrain import Box, Terrain, pose
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.legs import Leg

INPUTS = ["feedforward_torque", "desired_joint_state", "applied_spatial_force"]
OUTPUTS = [
    "plant_state",
    "depth_image",
    "camera_pose",
    "foot_contacts",
    "joint_encoders",
    "joint_torques",
    "contact_results",
    "query_object",
    "imu",
]
SMALL_CAMERA = DepthCameraConfig(width=64, height=48)


def slab(tilt=0.0, friction=0.8) -> Terrain:
    box = Box(size=[10, 10, 1], X_WE=pose([0, 0, -0.5], [0, -tilt, 0]), name="slab")
    return Terrain("slab", np.zeros(3), np.array([3.0, 0.0]), friction, (box,))


def standing(robot_name, terrain, config=None, start=(0.0, 0.0, 0.0)):
    """Returns the station and a simulator in which the robot's drives hold the standing pose at ``start``."""
    robot = load_robot(robot_name)
    station = ObservedStation(robot, terrain, config or StationConfig(camera=SMALL_CAMERA))
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    station.set_initial_state(context, *start)
    _, q = standing_pose(robot, GroundTruth(terrain), *start)
    station.GetInputPort("desired_joint_state").FixValue(context, np.concatenate([q, np.zeros(12)]))
    return station, simulator, context


def touching(station, context):
    """Links that touch the terrain, feet excepted."""
    results = station.GetOutputPort("contact_results").Eval(context)
    return touching_links(results, station.station.contact_geometries)


def state_of(station, context):
    return station.GetOutputPort("robot_state").Eval(context)


@pytest.mark.parametrize("robot", robot_names())
def test_ports_are_the_same_for_every_robot(robot):
    station = SimulationStation(load_robot(robot), load_terrain("flat"), StationConfig())
    assert station.get_name() == "station"
    assert [station.get_input_port(i).get_name() for i in range(station.num_input_ports())] == INPUTS
    assert sorted(station.get_output_port(i).get_name() for i in range(station.num_output_ports())) == sorted(OUTPUTS)
    assert [station.GetInputPort(name).size() for name in INPUTS[:2]] == [12, 24]
    context = station.CreateDefaultContext()
    image = station.GetOutputPort("depth_image").Eval(context)
    assert (image.width(), image.height()) == (640, 480)
    assert station.GetOutputPort("plant_state").Eval(context).shape == (37,)
    assert station.GetOutputPort("joint_torques").Eval(context).shape == (12,)
    assert station.GetOutputPort("imu").Eval(context).shape == (6,)
    assert not station.GetOutputPort("foot_contacts").Eval(context).contacts.any(), (
        "no forces are known before the first step"
    )


@pytest.mark.parametrize("robot_name", robot_names())
def test_stands_still(robot_name):
    station, simulator, context = standing(robot_name, load_terrain("flat"), start=(0.3, -0.2, 0.7))
    before = state_of(station, context)
    robot = station.robot
    assert before.p_WB[2] == pytest.approx(robot.nominal_base_height)
    simulator.AdvanceTo(2.0)
    state = state_of(station, context)
    assert state.stamp == 2.0
    sag = before.p_WB[2] - state.p_WB[2]
    assert 0.0 < sag < 0.012, "the drives' stiffness lets it down by about a centimetre"
    assert np.linalg.norm(state.p_WB[:2] - before.p_WB[:2]) < 0.02
    assert np.abs(state.rpy_WB - before.rpy_WB).max() < 0.01
    assert np.abs(state.v_WB).max() < 0.005
    assert np.abs(state.joint_velocities).max() < 0.02
    assert state.contacts.all()
    weight = GRAVITY * robot.mass
    np.testing.assert_allclose(state.contact_forces.sum(axis=0), [0.0, 0.0, weight], atol=0.01 * weight)
    assert touching(station, context) == []
    imu = station.GetOutputPort("imu").Eval(context)
    np.testing.assert_allclose(imu[:3], 0.0, atol=0.02)
    np.testing.assert_allclose(imu[3:], [0.0, 0.0, GRAVITY], atol=0.15)


def test_oracle_state_is_the_plant_s():
    station, simulator, context = standing("anymal_c", slab())
    plant = station.station.plant
    plant_context = plant.GetMyMutableContextFromRoot(context)
    rng = np.random.default_rng(3)
    rpy = np.array([0.1, -0.2, 2.5])
    station.robot.set_state(plant, plant_context, [0.1, 0.2, 1.5], rpy, station.robot.nominal_joints)
    plant.SetVelocities(plant_context, rng.uniform(-0.5, 0.5, 18))
    simulator.AdvanceTo(0.01)
    state = state_of(station, context)
    base = plant.GetBodyByName("base")
    X_WB, V_WB = plant.EvalBodyPoseInWorld(plant_context, base), plant.EvalBodySpatialVelocityInWorld(plant_context, base)
    np.testing.assert_allclose(state.p_WB, X_WB.translation())
    np.testing.assert_allclose(state.R_WB, X_WB.rotation().matrix(), atol=1e-12)
    np.testing.assert_allclose(state.v_WB, V_WB.translational())
    np.testing.assert_allclose(state.w_WB, V_WB.rotational())
    for k, name in enumerate(station.robot.joint_names):
        joint = plant.GetJointByName(name)
        assert state.joint_positions[k] == joint.get_angle(plant_context)
        assert state.joint_velocities[k] == joint.get_angular_rate(plant_context)
    assert not state.contacts.any()
    X_WC = station.GetOutputPort("camera_pose").Eval(context).GetAsMatrix4()
    np.testing.assert_allclose(X_WC, X_WB.GetAsMatrix4() @ station.robot.camera().X_BC, atol=1e-12)


def test_imu_feels_nothing_in_free_fall():
    station, simulator, context = standing("go2", slab(), StationConfig(camera=SMALL_CAMERA, stiffness=[0, 0, 0]))
    plant = station.station.plant
    plant_context = plant.GetMyMutableContextFromRoot(context)
    station.robot.set_state(plant, plant_context, [0, 0, 2.0], [0, 0, 0], station.robot.nominal_joints)
    simulator.AdvanceTo(0.02)
    imu = station.GetOutputPort("imu").Eval(context)
    np.testing.assert_allclose(imu[3:], 0.0, atol=0.05)


def test_torques_are_clamped_to_the_effort_limits():
    station, simulator, context = standing("go2", slab())
    limits = station.robot.effort_limits
    station.GetInputPort("feedforward_torque").FixValue(context, 1000.0 * np.resize([1.0, -1.0], 12))
    simulator.AdvanceTo(0.005)
    torques = station.GetOutputPort("joint_torques").Eval(context)
    np.testing.assert_allclose(np.abs(torques), limits)


def test_feet_and_terrain_share_the_terrain_s_friction():
    """A slope of 0.3 rad holds with friction 0.5 and does not with 0.2 (tan 0.3 = 0.31)."""
    slid = {}
    for friction in (0.5, 0.2):
        station, simulator, context = standing("go2", slab(tilt=0.3, friction=friction))
        before = state_of(station, context).p_WB
        simulator.AdvanceTo(0.6)
        slid[friction] = np.linalg.norm(state_of(station, context).p_WB - before)
    assert slid[0.5] < 0.04
    assert slid[0.2] > 0.10


def test_a_fall_is_noticed():
    config = StationConfig(camera=SMALL_CAMERA, stiffness=[0, 0, 0], damping=[0, 0, 0])
    station, simulator, context = standing("anymal_c", slab(), config)
    assert touching(station, context) == []
    simulator.AdvanceTo(2.0)
    links = touching(station, context)
    assert any(link.endswith("THIGH") for link in links), "it sinks onto its knees"
    assert not any(link.endswith("HIP") for link in links)


def test_stands_on_uneven_ground():
    boxes = tuple(
        Box(size=[0.3, 0.3, 0.2], X_WE=pose([0.36 * leg.fore, 0.17 * leg.side, -0.1 + 0.02 * leg]), name=leg.name)
        for leg in Leg
    )
    terrain = Terrain("steps", np.zeros(3), np.array([1.0, 0.0]), 0.8, boxes)
    station, simulator, context = standing("anymal_c", terrain)
    simulator.AdvanceTo(0.3)
    state = state_of(station, context)
    assert state.contacts.all()
    assert np.abs(state.rpy_WB).max() < 0.02


def test_no_ground_under_a_foot():
    terrain = load_terrain("stepping_stones")
    station = SimulationStation(load_robot("anymal_c"), slab(), StationConfig(camera=SMALL_CAMERA))
    with pytest.raises(UserInputError, match=r"start 4\.8,0,0: there is no ground under the foot LF"):
        station.set_initial_state(station.CreateDefaultContext(), 4.8, 0.0, 0.0)
    station = SimulationStation(load_robot("anymal_c"), terrain, StationConfig(camera=SMALL_CAMERA))
    station.set_initial_state(station.CreateDefaultContext(), *terrain.start)


def test_a_clone_continues_alike_to_the_bit():
    config = StationConfig(camera=SMALL_CAMERA, imu=ImuConfig(gyro_sigma=1e-3, accelerometer_sigma=0.01))
    station, simulator, context = standing("go2", slab(), config)
    simulator.AdvanceTo(0.05)
    twin = Simulator(station, context.Clone())
    for s in (simulator, twin):
        s.AdvanceTo(0.1)
    a, b = context, twin.get_context()
    for name in ("plant_state", "imu", "joint_torques"):
        np.testing.assert_array_equal(station.GetOutputPort(name).Eval(a), station.GetOutputPort(name).Eval(b))
    images = [station.GetOutputPort("depth_image").Eval(c).data for c in (a, b)]
    np.testing.assert_array_equal(*images)
    np.testing.assert_array_equal(state_of(station, a).contact_forces, state_of(station, b).contact_forces)


def test_camera_options():
    config = StationConfig(camera_name="left", camera_pitch=0.9, camera=DepthCameraConfig(width=80, height=60))
    station = SimulationStation(load_robot("anymal_c"), slab(), config)
    assert (station.camera_intrinsics.width, station.camera_intrinsics.height) == (80, 60)
    X_WC = station.GetOutputPort("camera_pose").Eval(station.CreateDefaultContext()).GetAsMatrix4()
    np.testing.assert_allclose(X_WC[:3, 2], [0.0, np.cos(0.9), -np.sin(0.9)], atol=1e-6)


@pytest.mark.parametrize(
    "bad",
    [{"time_step": 0.1}, {"contact_approximation": "magic"}, {"stiffness": [1.0]}, {"damping": [1.0, 1.0, -1.0]}],
)
def test_bad_config(bad):
    with pytest.raises(UserInputError, match=f"^{next(iter(bad))}.* must "):
        StationConfig(**bad)
    with pytest.raises(UserInputError, match="unknown camera 'top'"):
        SimulationStation(load_robot("go2"), slab(), StationConfig(camera_name="top"))


@pytest.mark.parametrize("robot_name", robot_names())
def test_a_start_inside_an_obstacle_is_refused(robot_name):
    ground = slab().elements[0]

    def place(*obstacles):
        standing(robot_name, Terrain("yard", np.zeros(3), np.array([3.0, 0.0]), 0.8, (ground, *obstacles)))

    across = Box(size=[0.04, 3, 1], X_WE=pose([0.1, 0, 0.5]), name="wall")
    with pytest.raises(UserInputError, match=r"start 0,0,0: the robot's \w+ would be 0\.\d\d m inside box 'wall'; start"):
        place(across)
    along = Box(size=[3, 0.04, 1], X_WE=pose([0, 0.02, 0.5], [0, 0, 0.1]), name="wall")
    with pytest.raises(UserInputError, match="inside box 'wall'"):
        place(along)
    robot = load_robot(robot_name)
    x, y = robot.nominal_footholds_B[Leg.LF, :2]
    beam = Box(size=[0.03, 0.05, 1], X_WE=pose([x - 0.06, y, 0.5]), name="post")
    with pytest.raises(UserInputError, match=r"robot's LF_\w+ would be .* inside box 'post'"):
        place(beam)
    kerb = Box(size=[0.05, 3, 0.5 * robot.nominal_base_height], X_WE=pose([0, 0, 0]), name="kerb")
    place(kerb)


def test_two_legs_against_each_other_are_the_robot_touching_itself():
    station, simulator, context = standing("anymal_c", slab())
    geometries = station.station.contact_geometries
    robot, plant = station.robot, station.station.plant
    results = station.GetOutputPort("contact_results")
    simulator.AdvanceTo(0.002)
    assert links_touching_each_other(results.Eval(context), geometries) == []
    joints = np.array(robot.nominal_joints)
    joints[Leg.LF.joints], joints[Leg.RF.joints] = [-0.65, 0.8, -1.2], [0.65, 0.8, -1.2]  # both inward
    robot.set_state(plant, plant.GetMyMutableContextFromRoot(context), [0.0, 0.0, 1.0], np.zeros(3), joints)
    simulator.AdvanceTo(0.004)
    assert links_touching_each_other(results.Eval(context), geometries) == [("LF_SHANK", "RF_SHANK")]
    assert touching(station, context) == []
