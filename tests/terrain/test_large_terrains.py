"""Terrains of thousands of elements: what they cost grows with their number, and the robot touches what is near it."""

import numpy as np
import pytest
from pydrake.geometry import Role
from pydrake.systems.analysis import Simulator

from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.sensing.depth_camera import DepthCameraConfig
from quadpips_drake.terrain import ground_window, plant_builder
from quadpips_drake.terrain.ground_window import HALF_WIDTH, MAX_STRAY
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.plant_builder import num_collision_shapes
from quadpips_drake.terrain.standing_pose import standing_pose
from quadpips_drake.terrain.terrain import MAX_ELEMENTS, Box, Cylinder, Mesh, Sphere, Terrain, pose
from quadpips_drake.terrain.triangles import joined_triangles
from quadpips_drake.terrain.truth import GroundTruth


def tiles(count: int, size: float = 0.5) -> Terrain:
    """A square of level tiles around the origin."""
    side = int(np.ceil(np.sqrt(count)))
    elements = []
    for i in range(count):
        x, y = size * (i // side - side / 2 + 0.5), size * (i % side - side / 2 + 0.5)
        elements.append(Box(size=(size, size, 0.1), X_WE=pose((x, y, -0.05))))
    return Terrain("tiles", (0, 0, 0), (1, 0), 1.0, tuple(elements))


def hill(cells: int, size: float) -> Mesh:
    """An open mesh of 2 cells^2 triangles around the origin."""
    x, y = np.meshgrid(np.linspace(-size, size, cells + 1), np.linspace(-size, size, cells + 1))
    z = 0.02 * np.sin(2 * x) * np.cos(3 * y)
    i, j = (g.ravel() for g in np.meshgrid(range(cells), range(cells)))
    a = (cells + 1) * j + i
    quads = np.column_stack((a, a + 1, a + cells + 2, a + cells + 1))
    vertices = np.column_stack((x.ravel(), y.ravel(), z.ravel()))
    return Mesh(vertices=vertices, triangles=np.concatenate((quads[:, :3], quads[:, [0, 2, 3]])))


def make_station(terrain: Terrain):
    """A Go2 with a small camera."""
    return SimulationStation(load_robot("go2"), terrain, StationConfig(camera=DepthCameraConfig(width=64, height=48)))


def standing(terrain: Terrain, start=(0.0, 0.0, 0.0)):
    """A station whose robot is held standing by its drives: station, simulator, context."""
    station = make_station(terrain)
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    station.set_initial_state(context, *start)
    _, q = standing_pose(station.robot, GroundTruth(terrain), *start)
    station.GetInputPort("desired_joint_state").FixValue(context, np.concatenate([q, np.zeros(12)]))
    return station, simulator, context


def terrain_shapes(scene_graph, role: Role, context=None) -> list[str]:
    """Names of the terrain's geometries with a role, by default before there is a context."""
    if context is None:
        inspector = scene_graph.model_inspector()
    else:
        inspector = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context)).inspector()
    ids = inspector.GetGeometries(scene_graph.world_frame_id(), role)
    return [inspector.GetName(i) for i in ids if "terrain_" in inspector.GetName(i)]


def place(station, context, x: float, y: float):
    """Puts the base elsewhere."""
    robot = station.robot
    where = np.array([x, y, robot.nominal_base_height])
    robot.set_state(
        station.plant, station.plant.GetMyMutableContextFromRoot(context), where, np.zeros(3), robot.nominal_joints
    )


def test_nothing_that_grows_with_the_square_of_the_elements_holds_all_of_them():
    for terrain in (tiles(900), Terrain("hill", (0, 0, 0), (1, 0), 1.0, (hill(20, 5.0),))):
        station, _, context = standing(terrain)
        camera_scene = station.GetSubsystemByName("camera_scene")
        assert terrain_shapes(camera_scene, Role.kProximity) == []
        assert len(terrain_shapes(camera_scene, Role.kPerception)) == 1, "drawn as one mesh"
        assert terrain_shapes(station.scene_graph, Role.kProximity) == []
        near = terrain_shapes(station.scene_graph, Role.kProximity, context)
        assert 0.5 < len(near) / (2 * HALF_WIDTH + 0.5) ** 2 * 0.25 < 2.5
    small = make_station(load_terrain("stepping_stones"))
    assert len(terrain_shapes(small.scene_graph, Role.kProximity)) == 27, "small ones are touched as a whole"


@pytest.mark.parametrize("name", ["stairs", "sparse_stones"])
def test_ground_in_a_window_carries_like_the_whole(name, monkeypatch):
    terrain = load_terrain(name)
    states = []
    for most in (plant_builder.MAX_WHOLE, 3):
        monkeypatch.setattr(plant_builder, "MAX_WHOLE", most)
        station, simulator, context = standing(terrain, terrain.start)
        simulator.AdvanceTo(0.2)
        states.append(station.GetOutputPort("plant_state").Eval(context))
    np.testing.assert_array_equal(*states)


def test_the_window_moves_with_the_robot_and_stays_in_the_context():
    station, simulator, context = standing(tiles(900))
    before = terrain_shapes(station.scene_graph, Role.kProximity, context)
    place(station, context, MAX_STRAY + 0.1, -0.3)
    copy = context.Clone()
    station.bring_ground_near(context)
    after = terrain_shapes(station.scene_graph, Role.kProximity, context)
    assert set(after) != set(before)
    assert terrain_shapes(station.scene_graph, Role.kProximity, copy) == before
    simulator.AdvanceTo(0.05)
    assert station.GetOutputPort("contact_results").Eval(context).num_point_pair_contacts() >= 4
    place(station, context, 0.0, 0.0)
    station.bring_ground_near(context)
    assert set(terrain_shapes(station.scene_graph, Role.kProximity, context)) == set(before)


def test_nobody_falls_through_ground_that_was_left_behind():
    station, simulator, context = standing(tiles(900))
    place(station, context, MAX_STRAY + 0.1, 0.0)
    with pytest.raises(RuntimeError, match=r"call SimulationStation\.bring_ground_near"):
        simulator.AdvanceTo(0.05)
    never_placed = make_station(tiles(900))
    with pytest.raises(RuntimeError, match="bring_ground_near"):
        Simulator(never_placed).AdvanceTo(0.05)


def test_too_much_is_refused_in_one_line():
    with pytest.raises(UserInputError, match=f"{MAX_ELEMENTS + 1} elements and triangles; at most {MAX_ELEMENTS}"):
        tiles(MAX_ELEMENTS + 1)
    box = Box(size=(1, 1, 1))
    with pytest.raises(UserInputError, match="5203 elements and triangles"):
        Terrain("many", (0, 0, 0), (1, 0), 1.0, (hill(50, 5.0), box, hill(10, 1.0), box, box))
    dense = tiles(ground_window.MAX_SHAPES + 100, size=0.05)
    with pytest.raises(UserInputError, match="terrain 'tiles': 2100 elements and triangles lie within 2 m of"):
        make_station(dense)


def test_vertical_triangles_are_no_ground():
    wall = Mesh(vertices=[[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], triangles=[[0, 1, 2], [0, 1, 3]])
    assert num_collision_shapes(wall) == 1
    assert num_collision_shapes(Box(size=(1, 1, 1))) == 1


def test_joined_triangles_enclose_what_the_elements_do():
    turned = pose((0.3, -0.2, 0.5), (0.2, 0.4, 1.0))
    box, cylinder = Box(size=(1, 2, 3), X_WE=turned), Cylinder(radius=0.5, length=2.0, X_WE=turned)
    ball = Sphere(radius=0.8, X_WE=turned)
    volumes = {"box": 6.0, "cylinder": 0.5 * np.pi, "ball": 4 / 3 * np.pi * 0.8**3}
    alone = [([box], volumes["box"]), ([cylinder], volumes["cylinder"]), ([ball], volumes["ball"])]
    for elements, volume in [*alone, ([cylinder, ball, box], sum(volumes.values()))]:
        vertices, triangles = joined_triangles(elements)
        a, b, c = vertices[triangles].transpose(1, 0, 2)
        enclosed = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
        assert enclosed == pytest.approx(volume, rel=0.02), "closed, and wound counter-clockwise seen from outside"
