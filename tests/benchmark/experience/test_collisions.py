"""Contacts of feet and shanks with spheres, held against Drake's proximity engine and against geometry."""

import numpy as np
import pytest
from pydrake.geometry import Role, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.systems.framework import DiagramBuilder

from quadpips_drake.benchmark.experience.collisions import _gaps, first_contact
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.centroidal import centroidal_state
from quadpips_drake.values.legs import Leg


@pytest.fixture(scope="module")
def robot():
    return load_robot("anymal_c")


def standing(robot, p_WB=(0.0, 0.0, 0.6), rpy=(0.0, 0.0, 0.0)):
    return centroidal_state(np.array(p_WB), np.array(rpy), robot.nominal_joints)


def test_gaps_are_those_of_drake(robot):
    rng = np.random.default_rng(0)
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    (model,) = Parser(plant).AddModels(str(robot.urdf_path))
    center, radius = np.array([0.3, 0.1, 0.2]), 0.08
    pose, friction = RigidTransform(center), CoulombFriction(1.0, 1.0)
    ball = plant.RegisterCollisionGeometry(plant.world_body(), pose, Sphere(radius), "ball", friction)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyContextFromRoot(context)
    inspector = scene_graph.model_inspector()
    for _ in range(5):
        joints = robot.nominal_joints + 0.3 * rng.standard_normal(12)
        p_WB, rpy = np.array([0.0, 0.0, 0.5]) + 0.1 * rng.standard_normal(3), 0.2 * rng.standard_normal(3)
        plant.SetFreeBodyPose(plant_context, plant.GetBodyByName("base"), RigidTransform(RollPitchYaw(rpy), p_WB))
        for name, angle in zip(robot.joint_names, joints, strict=True):
            plant.GetJointByName(name, model).set_angle(plant_context, angle)
        query = plant.get_geometry_query_input_port().Eval(plant_context)
        states = centroidal_state(p_WB, rpy, joints)[None]
        for leg, gaps in zip(Leg, _gaps(robot, states, center[None]), strict=True):
            frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(f"{leg.name}_SHANK").index())
            shapes = inspector.GetGeometries(frame, Role.kProximity)
            exact = min(query.ComputeSignedDistancePairClosestPoints(shape, ball).distance for shape in shapes)
            assert gaps[0, 0] - radius == pytest.approx(exact, abs=1e-6)


def test_the_first_moment_is_found_between_the_states(robot):
    ahead = np.array([standing(robot, (x, 0.0, 0.6)) for x in (0.0, 0.1, 0.2)])
    foot = robot.foot_positions_B(robot.nominal_joints)[Leg.RF] + [0.0, 0.0, 0.6]
    radius = 0.05
    ball = foot + np.array([robot.foot_radius + radius + 0.12, 0.0, 0.0])
    contact = first_contact(robot, ahead, ball[None], np.array([radius]))
    assert (contact.leg, contact.sphere) == (Leg.RF, 0)
    assert contact.state == pytest.approx(1.25)
    assert contact.depth == pytest.approx(0.005, abs=2e-3)


def test_what_is_passed_beside_is_not_touched(robot):
    ahead = np.array([standing(robot, (x, 0.0, 0.6)) for x in (0.0, 0.1)])
    assert first_contact(robot, ahead, np.array([[0.0, 0.0, 0.1]]), np.array([0.05])) is None
    assert first_contact(robot, ahead, np.zeros((0, 3)), np.zeros(0)) is None


def test_a_shank_counts_as_a_foot_does(robot):
    state = np.array([standing(robot)] * 2)
    _, origins = robot.link_poses_B(robot.nominal_joints)
    knee = origins[3 * (Leg.LH + 1)] + [0.0, 0.0, 0.6]
    foot = robot.foot_positions_B(robot.nominal_joints)[Leg.LH] + [0.0, 0.0, 0.6]
    contact = first_contact(robot, state, (0.5 * (knee + foot))[None], np.array([0.05]))
    assert (contact.state, contact.leg) == (0.0, Leg.LH)
