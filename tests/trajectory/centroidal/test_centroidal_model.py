"""The centroidal model against finite differences and against Drake's MultibodyPlant."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant

from quadpips_drake.errors import UserInputError
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.values.centroidal import CentroidalInput as Input
from quadpips_drake.values.centroidal import CentroidalState as State
from quadpips_drake.values.centroidal import foot_forces
from quadpips_drake.values.robot_state import RobotState


def random_points(model, count, seed=0):
    """States and inputs of a robot in full motion, at no special place."""
    rng = np.random.default_rng(seed)
    states, inputs = np.empty((count, 24)), np.empty((count, 24))
    for x, u in zip(states, inputs, strict=True):
        x[State.LINEAR], x[State.ANGULAR], x[State.POSITION] = (
            rng.normal(size=3),
            0.3 * rng.normal(size=3),
            rng.normal(size=3),
        )
        x[State.ORIENTATION] = rng.uniform([-0.5, -0.5, -3.0], [0.5, 0.5, 3.0])
        x[State.JOINTS] = model.robot.nominal_joints + rng.uniform(-0.4, 0.4, 12)
        u[Input.FORCES], u[Input.JOINT_VELOCITIES] = 100 * rng.normal(size=12), 3 * rng.normal(size=12)
    return states, inputs


@pytest.fixture(scope="module", params=["anymal_c", "go2"])
def model(request):
    return CentroidalModel(load_robot(request.param))


@pytest.fixture(scope="module")
def drake(model):
    """A plant in which only the robot is, and a function that puts it into a state x, u."""
    plant = MultibodyPlant(0.0)
    instance = model.robot.add_to_plant(plant)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    base = plant.get_body(plant.GetFloatingBaseBodies().copy().pop())

    def put(x, u):
        model.robot.set_state(plant, context, x[State.POSITION], x[State.ORIENTATION], x[State.JOINTS])
        v_WB, w_WB = model.base_velocity(x, u)
        velocities = plant.GetVelocities(context, instance)
        velocities[-12:] = u[Input.JOINT_VELOCITIES]
        plant.SetVelocities(context, instance, velocities)
        plant.SetFreeBodySpatialVelocity(context=context, body=base, V_JpJc=SpatialVelocity(w=w_WB, v=v_WB))
        return plant, context

    return put


def test_momentum_agrees_with_drake(model, drake):
    for x, u in zip(*random_points(model, 5), strict=True):
        plant, context = drake(x, u)
        center = plant.CalcCenterOfMassPositionInWorld(context)
        momentum = plant.CalcSpatialMomentumInWorldAboutPoint(context, center)
        np.testing.assert_allclose(model.center_of_mass(x), center, atol=1e-10)
        np.testing.assert_allclose(momentum.translational() / model.mass, x[State.LINEAR], atol=1e-9)
        np.testing.assert_allclose(momentum.rotational() / model.mass, x[State.ANGULAR], atol=1e-9)


def test_feet_agree_with_drake(model, drake):
    states, inputs = random_points(model, 4, seed=1)
    p, v = model.feet(states, inputs)[:2]
    for k, (x, u) in enumerate(zip(states, inputs, strict=True)):
        plant, context = drake(x, u)
        for leg, name in enumerate(("LF", "RF", "LH", "RH")):
            shank = plant.GetBodyByName(f"{name}_SHANK")
            offset = model.tree.foot_offset[leg]
            X_WS = shank.EvalPoseInWorld(context)
            V_WS = shank.EvalSpatialVelocityInWorld(context)
            np.testing.assert_allclose(p[k, leg], X_WS @ offset, atol=1e-10)
            arm = X_WS.rotation() @ offset
            np.testing.assert_allclose(v[k, leg], V_WS.translational() + np.cross(V_WS.rotational(), arm), atol=1e-9)
        np.testing.assert_allclose(model.foot_positions(x), p[k], atol=1e-12)


def test_momentum_rate_is_that_of_forces_and_gravity(model):
    states, inputs = random_points(model, 3, seed=2)
    for x, u in zip(states, inputs, strict=True):
        rate = model.dynamics(x, u)
        forces, arms = foot_forces(u), model.foot_positions(x) - model.center_of_mass(x)
        np.testing.assert_allclose(rate[State.LINEAR], forces.sum(axis=0) / model.mass - [0, 0, GRAVITY], atol=1e-9)
        np.testing.assert_allclose(rate[State.ANGULAR], np.cross(arms, forces).sum(axis=0) / model.mass, atol=1e-9)


def test_pose_rates_follow_the_base_velocity(model):
    x, u = (points[0] for points in random_points(model, 1, seed=3))
    rate = model.dynamics(x, u)
    v_WB, w_WB = model.base_velocity(x, u)
    np.testing.assert_allclose(rate[State.POSITION], v_WB, atol=1e-12)
    expected = RollPitchYaw(x[State.ORIENTATION]).CalcAngularVelocityInParentFromRpyDt(rate[State.ORIENTATION])
    np.testing.assert_allclose(w_WB, expected, atol=1e-9)
    np.testing.assert_allclose(rate[State.JOINTS], u[Input.JOINT_VELOCITIES])


def central_difference(function, z, step=1e-6):
    columns = [(function(z + step * e) - function(z - step * e)) / (2 * step) for e in np.eye(len(z))]
    return np.stack(columns, axis=-1)


def test_derivatives_against_finite_differences(model):
    states, inputs = random_points(model, 3, seed=4)
    f, a, b = model.linearize(states, inputs)
    p_x, v_x, v_u = model.feet(states, inputs)[2:]
    for k, (x, u) in enumerate(zip(states, inputs, strict=True)):
        np.testing.assert_allclose(f[k], model.dynamics(x, u), atol=1e-9)
        np.testing.assert_allclose(a[k], central_difference(lambda z, u=u: model.dynamics(z, u), x), atol=2e-6)
        np.testing.assert_allclose(b[k], central_difference(lambda z, x=x: model.dynamics(x, z), u), atol=2e-6)

        def foot_position(z, u=u):
            return model.feet(z[None], u[None])[0][0]

        def foot_velocity(z, u=u):
            return model.feet(z[None], u[None])[1][0]

        def foot_velocity_by_input(z, x=x):
            return model.feet(x[None], z[None])[1][0]

        np.testing.assert_allclose(p_x[k], central_difference(foot_position, x), atol=2e-7)
        np.testing.assert_allclose(v_x[k], central_difference(foot_velocity, x), atol=2e-6)
        np.testing.assert_allclose(v_u[k], central_difference(foot_velocity_by_input, u), atol=2e-6)


def test_state_of_a_measurement_gives_back_its_velocities(model):
    rng = np.random.default_rng(5)
    rpy, v_WB, w_WB, rates = np.array([0.1, -0.2, 2.0]), rng.normal(size=3), rng.normal(size=3), rng.normal(size=12)
    R_WB = RigidTransform(RollPitchYaw(rpy), np.zeros(3)).rotation().matrix()
    zero = np.zeros((4, 3))
    measured = RobotState(
        0.0, np.ones(3), rpy, R_WB, v_WB, w_WB, model.robot.nominal_joints, rates, np.zeros(12), zero, np.ones(4, bool)
    )
    x = model.state_from_robot_state(measured)
    velocity, spin = model.base_velocity(x, np.concatenate((np.zeros(12), rates)))
    np.testing.assert_allclose(velocity, v_WB, atol=1e-10)
    np.testing.assert_allclose(spin, w_WB, atol=1e-10)


def test_weight_compensation_balances_linear_momentum(model):
    x = model.nominal_state()
    rate = model.dynamics(x, model.gravity_compensation([True, False, False, True]))
    np.testing.assert_allclose(rate[State.LINEAR], 0, atol=1e-12)
    np.testing.assert_allclose(model.foot_positions(x)[:, 2], model.robot.foot_radius, atol=1e-3)


def test_single_rigid_body_agrees_where_the_legs_rest_at_nominal(model):
    """With locked nominal joints both models are one; elsewhere the rigid one's base velocity ignores the legs."""
    rigid = CentroidalModel(model.robot, "single_rigid_body")
    assert rigid.mass == pytest.approx(model.mass)
    x, u = (points[0] for points in random_points(model, 1, seed=6))
    x[State.JOINTS], u[Input.JOINT_VELOCITIES] = model.robot.nominal_joints, 0.0
    np.testing.assert_allclose(rigid.dynamics(x, u), model.dynamics(x, u), atol=1e-10)
    u[Input.JOINT_VELOCITIES] = 2.0
    np.testing.assert_allclose(np.concatenate(rigid.base_velocity(x, u)), np.concatenate(rigid.base_velocity(x, 0 * u)))
    assert np.abs(rigid.dynamics(x, u) - model.dynamics(x, u))[6:12].max() > 1e-2
    np.testing.assert_allclose(rigid.foot_positions(x), model.foot_positions(x))
    a, b = rigid.linearize(x[None], u[None])[1:]
    np.testing.assert_allclose(a[0], central_difference(lambda z: rigid.dynamics(z, u), x), atol=2e-6)
    np.testing.assert_allclose(b[0], central_difference(lambda z: rigid.dynamics(x, z), u), atol=2e-6)


def test_unknown_models_are_refused(model):
    with pytest.raises(UserInputError, match="unknown model 'pendulum'"):
        CentroidalModel(model.robot, "pendulum")
