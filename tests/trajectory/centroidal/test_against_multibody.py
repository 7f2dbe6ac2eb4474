"""The centroidal model and all its derivatives against MultibodyPlant<AutoDiffXd>, to 1e-8."""

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.math import RollPitchYaw_
from pydrake.multibody.plant import MultibodyPlant

from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.values.centroidal import CentroidalInput as Input
from quadpips_drake.values.centroidal import CentroidalState as State
from tests.trajectory.centroidal.test_centroidal_model import random_points

TOLERANCE = 1e-8


def autodiff(values, gradient):
    return InitializeAutoDiff(np.asarray(values, float).reshape(-1, 1), gradient).ravel()


def parts(values):
    """Value and gradient of an array of AutoDiffXd, of its own shape."""
    flat = np.ravel(values).reshape(-1, 1)
    return ExtractValue(flat).reshape(np.shape(values)), ExtractGradient(flat).reshape(*np.shape(values), -1)


class DifferentiablePlant:
    """A robot in an otherwise empty MultibodyPlant<AutoDiffXd>."""

    def __init__(self, model):
        plant = MultibodyPlant(0.0)
        model.robot.add_to_plant(plant)
        plant.Finalize()
        self.model, self.plant = model, plant.ToAutoDiffXd()
        self.context = self.plant.CreateDefaultContext()

    def put(self, p_WB, rpy, q, v_WB, w_WB, rates):
        quaternion = RollPitchYaw_[AutoDiffXd](rpy).ToQuaternion()
        positions = [quaternion.w(), quaternion.x(), quaternion.y(), quaternion.z(), *p_WB, *q]
        self.plant.SetPositions(self.context, np.array(positions))
        self.plant.SetVelocities(self.context, np.array([*w_WB, *v_WB, *rates]))

    def momentum(self):
        center = self.plant.CalcCenterOfMassPositionInWorld(self.context)
        momentum = self.plant.CalcSpatialMomentumInWorldAboutPoint(self.context, center)
        return np.array([*momentum.translational(), *momentum.rotational()]) / self.model.mass

    def put_state(self, x, u):
        """Brings the plant into the state x, u as functions of [x; u]; returns the base velocities and rpy."""
        v_WB, w_WB = self.model.base_velocity(x, u)
        # First the momentum as a function of configuration and velocities; then its inverse by the base's velocities.
        z = np.concatenate(
            (
                x[State.POSITION],
                x[State.ORIENTATION],
                x[State.JOINTS],
                v_WB,
                w_WB,
                u[Input.JOINT_VELOCITIES],
            )
        )
        self.put(*np.split(autodiff(z, np.eye(36)), [3, 6, 18, 21, 24]))
        value, gradient = parts(self.momentum())
        np.testing.assert_allclose(value, x[State.MOMENTUM], atol=TOLERANCE)
        map_ = np.linalg.inv(gradient[:, 18:24])
        by_y = np.zeros((6, 48))
        by_y[:, :6], by_y[:, 6:24], by_y[:, 36:] = map_, -map_ @ gradient[:, :18], -map_ @ gradient[:, 24:]
        y = np.eye(48)
        twist = autodiff(np.concatenate((v_WB, w_WB)), by_y)
        rpy = autodiff(x[State.ORIENTATION], y[9:12])
        rates = autodiff(u[Input.JOINT_VELOCITIES], y[36:])
        self.put(
            autodiff(x[State.POSITION], y[6:9]),
            rpy,
            autodiff(x[State.JOINTS], y[12:24]),
            twist[:3],
            twist[3:],
            rates,
        )
        return twist, rpy, rates

    def feet(self):
        """Positions and velocities of the feet in W, each (4, 3)."""
        p, v = [], []
        for leg, name in enumerate(("LF", "RF", "LH", "RH")):
            shank = self.plant.GetBodyByName(f"{name}_SHANK")
            X_WS = shank.EvalPoseInWorld(self.context)
            arm = X_WS.rotation().matrix() @ self.model.tree.foot_offset[leg]
            V_WS = shank.EvalSpatialVelocityInWorld(self.context)
            p.append(X_WS.translation() + arm)
            v.append(V_WS.translational() + np.cross(V_WS.rotational(), arm))
        return np.array(p), np.array(v)


@pytest.fixture(scope="module", params=["anymal_c", "go2"])
def model(request):
    return CentroidalModel(load_robot(request.param))


def test_dynamics_and_feet_with_all_derivatives(model):
    drake = DifferentiablePlant(model)
    states, inputs = random_points(model, 3, seed=21)
    f, a, b = model.linearize(states, inputs)
    p, v, p_x, v_x, v_u = model.feet(states, inputs)
    for k, (x, u) in enumerate(zip(states, inputs, strict=True)):
        twist, rpy, rates = drake.put_state(x, u)
        foot_p, foot_v = drake.feet()
        for ours, by_x, by_u, theirs in ((p, p_x, 0 * v_u, foot_p), (v, v_x, v_u, foot_v)):
            value, gradient = parts(theirs)
            np.testing.assert_allclose(ours[k], value, atol=TOLERANCE)
            np.testing.assert_allclose(np.concatenate((by_x[k], by_u[k]), axis=-1), gradient, atol=TOLERANCE, rtol=1e-9)
        forces = autodiff(u[Input.FORCES], np.eye(48)[24:36]).reshape(4, 3)
        arms = foot_p - drake.plant.CalcCenterOfMassPositionInWorld(drake.context)
        torque = sum(np.cross(arm, force) for arm, force in zip(arms, forces, strict=True))
        rpy_rates = RollPitchYaw_[AutoDiffXd](rpy).CalcRpyDtFromAngularVelocityInParent(twist[3:])
        linear = forces.sum(axis=0) / model.mass - np.array([0.0, 0.0, GRAVITY])
        value, gradient = parts(np.concatenate((linear, torque / model.mass, twist[:3], rpy_rates, rates)))
        np.testing.assert_allclose(f[k], value, atol=TOLERANCE)
        np.testing.assert_allclose(np.hstack((a[k], b[k])), gradient, atol=TOLERANCE, rtol=1e-9)


def test_base_velocity_map(model):
    """h = A_b nu_b + A_j v_j, with both matrices from Drake."""
    drake = DifferentiablePlant(model)
    x, u = (points[0] for points in random_points(model, 1, seed=22))
    velocities = autodiff(np.zeros(18), np.eye(18))
    constant = [
        autodiff(part, np.zeros((len(part), 18))) for part in (x[State.POSITION], x[State.ORIENTATION], x[State.JOINTS])
    ]
    drake.put(*constant, *np.split(velocities, [3, 6]))
    matrix = parts(drake.momentum())[1]
    twist = np.linalg.solve(matrix[:, :6], x[State.MOMENTUM] - matrix[:, 6:] @ u[Input.JOINT_VELOCITIES])
    np.testing.assert_allclose(np.concatenate(model.base_velocity(x, u)), twist, atol=TOLERANCE)
    np.testing.assert_allclose(model.base_twists(x[None], u[None])[0], np.roll(twist, 3), atol=TOLERANCE)
    np.testing.assert_allclose(
        model.momentum(
            x[State.ORIENTATION],
            x[State.JOINTS],
            twist[:3],
            twist[3:],
            u[Input.JOINT_VELOCITIES],
        ),
        x[State.MOMENTUM],
        atol=TOLERANCE,
    )
