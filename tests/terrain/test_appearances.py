"""What appears, read from text, and what of it a robot's world shows before and after."""

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.appearing.appearances import parse_appearance
from quadpips_drake.terrain.files.terrain_file import write_terrain_file
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.terrain import Box, Cylinder, Sphere
from quadpips_drake.values.steppability import Steppability


def test_a_box_at_a_place():
    found = parse_appearance("box:0.3,0.2,0.1@1.5,-0.5,0.05,1.57@t=4")
    (box,) = found.elements
    assert isinstance(box, Box) and found.time == 4.0 and found.is_fixed and box.label == Steppability.NON_PASSABLE
    np.testing.assert_array_equal(box.size, [0.3, 0.2, 0.1])
    np.testing.assert_allclose(box.X_WE[:3, 3], [1.5, -0.5, 0.05])
    np.testing.assert_allclose(box.rpy, [0, 0, 1.57], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "half"), [("box:0.3,0.2,0.1@2,1@0", 0.05), ("cylinder:0.1,0.4@2,1@3", 0.2), ("sphere:0.25@foothold@2.5", 0.25)]
)
def test_what_is_given_no_height_stands_on_the_ground(text, half):
    found = parse_appearance(text)
    assert not found.is_fixed
    normal = np.array([0.6, 0.0, 0.8])
    (element,) = found.standing_at(np.array([2.0, 1.0, 0.5]), normal)
    assert isinstance(element, Box | Cylinder | Sphere)
    np.testing.assert_allclose(element.X_WE[:3, 3], np.array([2.0, 1.0, 0.5]) + half * normal)
    np.testing.assert_allclose(element.X_WE[:3, 2], normal)
    np.testing.assert_allclose(element.X_WE[:3, 1], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(element.X_WE), 1.0)


def test_a_file_brings_all_its_elements(tmp_path):
    terrain = load_terrain("stepping_stones")
    write_terrain_file(terrain, tmp_path / "more@home.yaml")
    found = parse_appearance(f"{tmp_path / 'more@home.yaml'}@t=2")
    assert found.time == 2.0 and found.is_fixed and len(found.elements) == len(terrain.elements)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("box", "'box' is no time"),
        ("box:0.3,0.3,0.2@1.5,0", "'1.5,0' is no time"),
        ("box:0.3,0.3,0.2@4", "something is missing"),
        ("box:0.3,0.3,0.2@1.5,0@-1", "'-1' is no time"),
        ("box:0.3,0.3,0.2@1.5,0@t=nan", "is no time"),
        ("box:0.3,0.3@1.5,0@4", "a box needs box:L,W,H"),
        ("box:0.3,0.3,0@1.5,0@4", "size must be between 0.001"),
        ("cone:0.3,0.3@1.5,0@4", "'cone' is none of box, cylinder, sphere"),
        ("box:0.3,0.3,0.2@1.5@4", "'1.5' is no place"),
        ("box:0.3,0.3,0.2@1,2,3,4,5@4", "'1,2,3,4,5' is no place"),
        ("box:0.3,0.3,0.2@there@4", "'there' is no place"),
        ("box:0.3,0.3,0.2@2000,0,0@4", "within 1000 m"),
        ("no_such_file.yaml@4", "no such file"),
        ("", "is no time"),
    ],
)
def test_other_texts_are_refused_in_one_line(text, words):
    with pytest.raises(UserInputError) as error:
        parse_appearance(text)
    assert words in str(error.value) and f"spawn '{text}'" in str(error.value) and "\n" not in str(error.value)
