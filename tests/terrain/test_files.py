"""Terrain files: what is written is read back, and whatever is wrong is said in one line."""

import json

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.files.terrain_file import write_terrain_file
from quadpips_drake.terrain.library import load_terrain, terrain_names
from quadpips_drake.terrain.terrain import Cylinder, Mesh, Sphere, Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.steppability import Steppability

GOOD = """
name: course
start: [0, 0, 0.1]
goal: [2, 0]
friction: 0.8
boxes:
- {size: [4, 3, 0.1], xyz: [1, 0, -0.05]}
- {size: [1, 3, 0.1], xyz: [5, 0, -1], rpy: [0, 0.2, 0], label: non_passable, name: pit}
cylinders:
- {radius: 0.1, length: 1e-1, xyz: [1, 1, 0.05], label: passable}
spheres:
- {radius: 0.2, xyz: [2, 1, 0.1], label: non_passable, name: ball}
meshes:
- {path: wedge.obj, scale: 2.0, xyz: [0, -1, 0]}
"""
WEDGE = "# a wedge\nv 0 0 0\nv 0.3 0 0\nv 0.3 0.2 0.1\nv 0 0.2 0.1\nvn 0 0 1\nf 1//1 2//1 3//1 -1//1\n"


@pytest.fixture
def write(tmp_path):
    """Returns a function that writes a terrain file and returns its path."""
    (tmp_path / "wedge.obj").write_text(WEDGE)

    def writer(text: str, name: str = "course.yaml") -> str:
        (tmp_path / name).write_text(text)
        return str(tmp_path / name)

    return writer


def assert_same(a: Terrain, b: Terrain):
    assert (a.name, a.friction) == (b.name, b.friction)
    np.testing.assert_allclose(a.start, b.start, atol=1e-11)
    np.testing.assert_allclose(a.goal, b.goal, atol=1e-11)
    assert [(type(e), e.name, e.label) for e in a.elements] == [(type(e), e.name, e.label) for e in b.elements]
    for mine, other in zip(a.elements, b.elements, strict=True):
        np.testing.assert_allclose(mine.X_WE, other.X_WE, atol=1e-10)
        np.testing.assert_allclose(mine.corners(), other.corners(), atol=1e-10)


def test_all_kinds_of_elements_are_read(write):
    terrain = load_terrain(write(GOOD))
    assert (terrain.name, terrain.friction, len(terrain.elements)) == ("course", 0.8, 5)
    np.testing.assert_array_equal(terrain.start, [0, 0, 0.1])
    pit, cylinder, sphere, mesh = terrain.elements[1:]
    assert (pit.label, cylinder.label) == (Steppability.NON_PASSABLE, Steppability.PASSABLE)
    assert isinstance(cylinder, Cylinder)
    assert cylinder.length == 0.1
    assert isinstance(sphere, Sphere) and (sphere.radius, sphere.label) == (0.2, Steppability.NON_PASSABLE)
    assert GroundTruth(terrain).height(2.0, 1.0) == pytest.approx(0.3)
    assert isinstance(mesh, Mesh)
    assert len(mesh.triangles) == 2
    assert GroundTruth(terrain).height(0.3, -0.7) == pytest.approx(0.15)


def test_round_trip(write, tmp_path):
    for name in terrain_names():
        terrain = load_terrain(name)
        write_terrain_file(terrain, tmp_path / "out.yaml")
        assert_same(terrain, load_terrain(str(tmp_path / "out.yaml")))
    terrain = load_terrain(write(GOOD))
    write_terrain_file(terrain, tmp_path / "out.yaml")
    assert_same(terrain, load_terrain(str(tmp_path / "out.yaml")))


def test_start_and_goal_can_be_given_from_outside(write):
    text = GOOD.replace("start: [0, 0, 0.1]\n", "").replace("goal: [2, 0]\n", "")
    with pytest.raises(UserInputError, match="start: missing"):
        load_terrain(write(text))
    terrain = load_terrain(write(text), start=[1, 0, 0], goal=[1.5, 0])
    np.testing.assert_array_equal(terrain.goal, [1.5, 0])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("name: course", "name: [1, 2]", "name: must be printable text"),
        ("start: [0, 0, 0.1]", "start: [0, 0]", "start: must be a list of 3 numbers"),
        ("start: [0, 0, 0.1]", "start: here", "start: must be a list of 3 numbers, not 'here'"),
        ("goal: [2, 0]", "goal: [.nan, 0]", r"goal\[0\]: must be a finite number"),
        ("goal: [2, 0]", "goal: [.inf, 0]", r"goal\[0\]: must be a finite number"),
        ("goal: [2, 0]", "goal: [1e9, 0]", "goal of terrain"),
        ("friction: 0.8", "friction: -1", "friction"),
        ("friction: 0.8", "friction: true", "friction: must be a finite number"),
        ("friction: 0.8", "fricton: 1", "unknown key 'fricton'; known: boxes"),
        ("size: [4, 3, 0.1]", "size: [4, 3, 0]", r"boxes\[0\]: .*size must be between"),
        ("size: [4, 3, 0.1]", "size: [4, 3, -0.1]", r"boxes\[0\]: .*size must be between"),
        ("size: [4, 3, 0.1]", "size: [4, 3]", r"boxes\[0\]\.size: must be a list of 3 numbers"),
        ("size: [4, 3, 0.1], ", "", r"boxes\[0\]\.size: missing"),
        ("xyz: [1, 0, -0.05]", "xyz: [1, 0, 1e5]", r"boxes\[0\]: .*within 1000 m"),
        ("label: passable", "label: lava", r"cylinders\[0\]\.label: unknown label 'lava'; known: unknown, steppable"),
        ("radius: 0.1", "radius: big", r"cylinders\[0\]\.radius: must be a finite number, not 'big'"),
        ("radius: 0.1", "radius: 0.1, colour: red", r"cylinders\[0\]: unknown key 'colour'"),
        ("path: wedge.obj", "path: missing.obj", r"meshes\[0\]\.path: .*missing\.obj.: no such file"),
        ("path: wedge.obj", "path: /etc/passwd", "not an .obj file"),
        ("scale: 2.0", "scale: 0", r"meshes\[0\]\.scale"),
        ("cylinders:\n", "cylinders: 7\nother:\n", "unknown key 'other'"),
        ("boxes:\n", "cylinders: 7\nboxes:\n", "'cylinders' appears twice"),
        ("name: course", "name: !!python/object/apply:os.system ['true']", "not valid YAML"),
        ("name: course", "name: [", "not valid YAML"),
        ("name: course", "? [a, {b: c}]\n: d", "not valid YAML|unknown key"),
    ],
)
def test_what_is_wrong_is_said_with_file_and_key(write, old, new, said):
    assert old in GOOD
    path = write(GOOD.replace(old, new, 1))
    with pytest.raises(UserInputError, match=said) as error:
        load_terrain(path)
    assert str(error.value).startswith(f"terrain file '{path}'")
    assert "\n" not in str(error.value)


def test_hostile_files_are_refused(write, tmp_path):
    bomb = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
        f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
    )
    merge = "a: &a {x: 1}\n" + "".join(
        f"{b}: &{b} {{<<: [{', '.join([f'*{a}'] * 9)}]}}\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
    )
    many = "start: [0, 0, 0]\ngoal: [1, 0]\nboxes:\n" + "- {size: [1, 1, 1], xyz: [0, 0, 0]}\n" * 5001
    cases = {
        "bomb.yaml": bomb,
        "merge.yaml": merge,
        "keys.yaml": "".join(f"k{i}: 1\n" for i in range(20_000)),
        "deep.yaml": "[" * 20000,
        "many.yaml": many,
        "empty.yaml": "",
        "list.yaml": "- 1",
        "none.yaml": "start: [0, 0, 0]\ngoal: [1, 0]\nboxes:\n",
        "digits.yaml": "start: [" + "9" * 5000 + ", 0, 0]\ngoal: [1, 0]\nboxes: [{size: [1, 1, 1], xyz: [0, 0, 0]}]",
    }
    for name, text in cases.items():
        with pytest.raises(UserInputError, match=name) as error:
            load_terrain(write(text, name))
        assert len(str(error.value)) < 600
    (tmp_path / "binary.yaml").write_bytes(bytes(range(256)))
    (tmp_path / "folder.yaml").mkdir()
    for name, said in (("binary", "UTF-8"), ("folder", "not a regular file"), ("absent", "no such file")):
        with pytest.raises(UserInputError, match=said):
            load_terrain(str(tmp_path / f"{name}.yaml"))


@pytest.mark.parametrize(
    "text",
    ["v 0 0\nf 1 2 3\n", "v 0 0 0\nf 1 2 9\n", "v 0 0 0\nf 1 1\n", "v 0 0 0\n", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"],
)
def test_bad_meshes_are_refused(write, tmp_path, text):
    (tmp_path / "bad.obj").write_text(text)
    with pytest.raises(UserInputError, match=r"meshes\[0\]"):
        load_terrain(write(GOOD.replace("wedge.obj", "bad.obj")))


def test_stone_setup_of_the_authors(write):
    setup = {
        "poses": [[0, 0, -0.05, 0, 0, 0], [2, 0, 0.2, 0, -0.175, 0]],
        "scales": [[3, 3, 0.1], [2, 2, 0.1]],
        "colors": [[1, 0, 0, 1]] * 2,
    }
    path = write(json.dumps({"stone_setup": setup}), "stones.json")
    terrain = load_terrain(path, start=(-0.5, 0, 0), goal=(2, 0))
    assert (terrain.name, len(terrain.elements)) == ("stones", 2)
    np.testing.assert_allclose(terrain.elements[1].rpy, [0, -0.175, 0], atol=1e-12)
    with pytest.raises(UserInputError, match="start: this format has none; give --start X,Y,YAW"):
        load_terrain(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "not valid JSON"),
        ("[]", "stone_setup: missing"),
        ('{"stone_setup": {"poses": [], "scales": []}}', "poses: must be a list of 1 to 5000"),
        ('{"stone_setup": {"poses": [[0,0,0,0,0,0]], "scales": []}}', "scales: must be a list of 1"),
        ('{"stone_setup": {"poses": [[0,0,0,0,0,0]], "scales": [[1,1,1],[1,1,1]]}}', "has 2 entries but there are 1 poses"),
        ('{"stone_setup": {"poses": [[0,0,0,0,0]], "scales": [[1,1,1]]}}', r"poses\[0\]: must be 6 finite numbers"),
        ('{"stone_setup": {"poses": [[0,0,NaN,0,0,0]], "scales": [[1,1,1]]}}', r"poses\[0\]: must be 6 finite numbers"),
        ('{"stone_setup": {"poses": [[0,0,0,0,0,0]], "scales": [[1,1,0]]}}', "entry 0: .*size must be between"),
        ("[" * 100000, "not valid JSON"),
    ],
)
def test_bad_stone_setups(write, text, said):
    with pytest.raises(UserInputError, match=said):
        load_terrain(write(text, "stones.json"), start=(0, 0, 0), goal=(1, 0))
