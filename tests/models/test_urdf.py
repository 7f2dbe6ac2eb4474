"""The URDFs against the published figures of the robots (tables in section 4 of the project's collected facts)."""

import numpy as np
import pytest
from pydrake.geometry import Role, SceneGraph, Sphere
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from quadpips_drake.robots.robot_library import load_robot, robot_names
from quadpips_drake.robots.robot_model import JOINT_NAMES, LINK_NAMES
from quadpips_drake.values.legs import Leg

MASSES = {
    "anymal_c": {"base": 26.3732, "HIP": 2.7810, "THIGH": 3.0710, "SHANK": 0.58842},
    "go2": {"base": 7.277, "HIP": 0.767, "THIGH": 1.241, "SHANK": 0.214},
}
TOTAL_MASS = {"anymal_c": 52.1349, "go2": 16.165}
MIRROR_Y = np.diag([1.0, -1.0, 1.0])


@pytest.fixture(scope="module", params=robot_names())
def robot(request):
    return load_robot(request.param)


def parse(robot):
    plant, scene_graph = MultibodyPlant(time_step=1e-3), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    Parser(plant).AddModels(str(robot.urdf_path))
    plant.Finalize()
    return plant, scene_graph.model_inspector()


def test_masses(robot):
    assert robot.mass == pytest.approx(TOTAL_MASS[robot.name], abs=1e-3)
    for link, mass in zip(LINK_NAMES, robot.tree.link_mass, strict=True):
        assert mass == MASSES[robot.name][link.split("_")[-1]]


def test_inertias_are_physical(robot):
    for inertia in robot.tree.link_inertia:
        np.testing.assert_array_equal(inertia, inertia.T)
        a, b, c = np.linalg.eigvalsh(inertia)
        assert a > 0
        assert a + b >= c, "triangle inequality of the principal moments"


def test_left_and_right_are_mirror_images(robot):
    tree = robot.tree
    for left, right in ((Leg.LF, Leg.RF), (Leg.LH, Leg.RH)):
        np.testing.assert_allclose(tree.foot_offset[right], MIRROR_Y @ tree.foot_offset[left])
        for i in range(3):
            link, twin = 1 + 3 * left + i, 1 + 3 * right + i
            np.testing.assert_allclose(tree.joint_offset[twin - 1], MIRROR_Y @ tree.joint_offset[link - 1])
            np.testing.assert_allclose(tree.link_com[twin], MIRROR_Y @ tree.link_com[link], atol=1e-12)
            np.testing.assert_allclose(tree.link_inertia[twin], MIRROR_Y @ tree.link_inertia[link] @ MIRROR_Y, atol=1e-12)


def test_anymal_is_symmetric_fore_and_aft():
    tree = load_robot("anymal_c").tree
    mirror = np.diag([-1.0, 1.0, 1.0])
    for fore, hind in ((Leg.LF, Leg.LH), (Leg.RF, Leg.RH)):
        np.testing.assert_allclose(tree.foot_offset[hind], mirror @ tree.foot_offset[fore])
        for i in range(3):
            link, twin = 1 + 3 * fore + i, 1 + 3 * hind + i
            np.testing.assert_allclose(tree.joint_offset[twin - 1], mirror @ tree.joint_offset[link - 1])
            np.testing.assert_allclose(tree.link_inertia[twin], mirror @ tree.link_inertia[link] @ mirror, atol=1e-12)


def test_limits():
    anymal, go2 = load_robot("anymal_c"), load_robot("go2")
    np.testing.assert_array_equal(anymal.effort_limits, 80.0)
    np.testing.assert_array_equal(anymal.velocity_limits, 7.5)
    np.testing.assert_array_equal(go2.effort_limits, np.tile([23.7, 23.7, 35.55], 4))
    np.testing.assert_array_equal(go2.velocity_limits, np.tile([30.1, 30.1, 20.06], 4))
    assert anymal.position_limits_upper[Leg.LF.joints][2] == 0.0, "fore knees of ANYmal bend backwards"
    assert anymal.position_limits_lower[Leg.LH.joints][2] == 0.0, "hind knees of ANYmal bend forwards"
    np.testing.assert_allclose(go2.rotor_inertia[:2], 1.118e-4 * 6.33**2)
    np.testing.assert_allclose(anymal.rotor_inertia, 0.06)


def test_nominal_stance_is_well_within_the_limits(robot):
    assert (robot.nominal_joints > robot.position_limits_lower + 0.2).all()
    assert (robot.nominal_joints < robot.position_limits_upper - 0.2).all()


def test_joints_are_in_our_order(robot):
    plant = MultibodyPlant(time_step=1e-3)
    instance = robot.add_to_plant(plant)
    plant.Finalize()
    assert [name.removesuffix("_q") for name in plant.GetPositionNames(instance)[7:]] == list(JOINT_NAMES)
    assert [name.removesuffix("_w") for name in plant.GetVelocityNames(instance)[6:]] == list(JOINT_NAMES)
    assert plant.GetActuatorNames(instance) == list(JOINT_NAMES)
    assert plant.num_bodies() == len(LINK_NAMES) + 1, "one more for the world"


def test_every_link_can_be_seen_and_the_lower_ones_felt(robot):
    plant, inspector = parse(robot)
    for link in LINK_NAMES:
        frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(link).index())
        assert inspector.GetGeometries(frame, Role.kPerception)
        assert inspector.GetGeometries(frame, Role.kProximity) or link.endswith("HIP")
        spheres = [
            inspector.GetShape(g).radius()
            for g in inspector.GetGeometries(frame, Role.kPerception)
            if isinstance(inspector.GetShape(g), Sphere)
        ]
        assert robot.foot_radius in spheres or not link.endswith("SHANK"), "the foot that is drawn is the foot that touches"
