"""One instance of every system of this stage."""

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import LeafSystem

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.sensing.contact_sensing import ContactGeometries
from quadpips_drake.sensing.depth_camera import DepthCameraConfig, make_intrinsics
from quadpips_drake.sensing.depth_noise import DepthNoiseConfig
from quadpips_drake.sensing.depth_noise_system import DepthNoise
from quadpips_drake.sensing.foot_contact_sensor_system import FootContactSensor
from quadpips_drake.sensing.imu_system import Imu, ImuConfig
from quadpips_drake.sensing.self_filter import SelfFilterConfig
from quadpips_drake.sensing.self_filter_system import SelfFilter


def make_systems() -> list[LeafSystem]:
    robot = load_robot("go2")
    plant = MultibodyPlant(time_step=1e-3)
    robot.add_to_plant(plant)
    plant.Finalize()
    intrinsics = make_intrinsics(DepthCameraConfig(width=64, height=48))
    return [
        FootContactSensor(ContactGeometries({}, {})),
        DepthNoise(DepthNoiseConfig(), intrinsics=intrinsics),
        Imu(robot, plant, ImuConfig()),
        SelfFilter(robot, SelfFilterConfig(), intrinsics=intrinsics),
    ]
