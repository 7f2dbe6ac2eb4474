"""An inertial measurement unit."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.robots.robot_model import RobotModel

_STAMP_RESOLUTION = 1e-6


@configuration
class ImuConfig:
    """White noise of gyroscope and accelerometer; zero, the default, means an ideal sensor.

    The simulation of QuadPiPS used 2e-4 rad/s and 1.7e-2 m/s^2.
    """

    gyro_sigma: float = ranged(0.0, 0.0, 10.0)
    """Standard deviation of each angular velocity sample [rad/s]."""
    accelerometer_sigma: float = ranged(0.0, 0.0, 100.0)
    """Standard deviation of each specific force sample [m/s^2]."""


class Imu(LeafSystem):
    """Measures the base's angular velocity and the specific force at the place of the IMU.

    w_WB expressed in B, and f = R_WB^T (a_WS - g) with a_WS = a_WB + alpha x p_BS + w x (w x p_BS): on a robot that stands
    still, f points up with 9.81 m/s^2. The noise depends on the seed and on the time (to the microsecond) alone.

    .. pydrake_system::

        name: Imu
        input_ports:
        - body_poses
        - body_spatial_velocities
        - body_spatial_accelerations
        output_ports:
        - imu

    - body_poses, body_spatial_velocities, body_spatial_accelerations: the plant's ports of the same names.
    - imu: angular velocity [rad/s] (3) and specific force [m/s^2] (3), both in the base's axes, vector (6,); continuous.
    """

    def __init__(self, robot: RobotModel, plant: MultibodyPlant, config: ImuConfig, *, seed: int = 0):
        """Args: robot; the finalized plant that holds it; config; seed, not negative."""
        LeafSystem.__init__(self)
        self._config, self._seed = config, seed
        self._p_BS = np.array(robot.imu_position)
        self._gravity = plant.gravity_field().gravity_vector()
        self._base = int(plant.GetBodyByName("base", plant.GetModelInstanceByName(robot.name)).index())
        inputs = {
            "body_poses": [RigidTransform()],
            "body_spatial_velocities": [SpatialVelocity()],
            "body_spatial_accelerations": [SpatialAcceleration()],
        }
        self._inputs = [self.DeclareAbstractInputPort(name, AbstractValue.Make(value)) for name, value in inputs.items()]
        self.DeclareVectorOutputPort("imu", 6, self._calc_imu)

    def _calc_imu(self, context, output):
        pose, velocity, acceleration = (port.Eval(context)[self._base] for port in self._inputs)
        R_WB = pose.rotation().matrix()
        p_BS_W = R_WB @ self._p_BS
        w, alpha = velocity.rotational(), acceleration.rotational()
        a_WS = acceleration.translational() + np.cross(alpha, p_BS_W) + np.cross(w, np.cross(w, p_BS_W))
        sample = np.concatenate([R_WB.T @ w, R_WB.T @ (a_WS - self._gravity)])
        sigma = np.repeat([self._config.gyro_sigma, self._config.accelerometer_sigma], 3)
        if sigma.any():
            frame = max(round(context.get_time() / _STAMP_RESOLUTION), 0)
            sample = sample + sigma * np.random.default_rng([self._seed, frame]).standard_normal(6)
        output.SetFromVector(sample)
