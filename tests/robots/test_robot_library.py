"""Robots by name and by file, and files that are not as they must be."""

import shutil

import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot, robot_defaults_layer, robot_file


@pytest.fixture
def dog(tmp_path):
    """A copy of the Go2 that may be spoiled."""
    shutil.copytree(robot_file("go2").parent, tmp_path / "dog")
    return tmp_path / "dog"


def test_a_robot_outside_the_package(dog):
    robot = load_robot(dog / "robot.yaml")
    assert robot.name == "dog" and robot.mass == load_robot("go2").mass
    assert load_robot(str(dog)) is robot, "its folder will do"
    assert robot_defaults_layer(dog / "robot.yaml").data == robot_defaults_layer("go2").data
    (dog / "defaults.yaml").unlink()
    assert robot_defaults_layer(dog / "robot.yaml").data == {}


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda dog: (dog / "robot.yaml").unlink(), "no such file"),
        (lambda dog: (dog / "go2.urdf").unlink(), "'urdf' must name the robot's URDF"),
        (lambda dog: (dog / "robot.yaml").write_text("{urdf: go2.urdf, legs: 5}"), "unknown key 'legs'"),
        (lambda dog: (dog / "go2.urdf").write_text("<robot"), "cannot be used as a robot"),
        (lambda dog: (dog / "go2.urdf").write_text("<robot name='x'><link name='base'/></robot>"), "go2.urdf"),
        (lambda dog: (dog / "robot.yaml").write_bytes(b"\xff\xfe\x00"), "robot.yaml"),
    ],
    ids=["no file", "no URDF", "unknown key", "no XML", "other links", "no text"],
)
def test_a_broken_robot_is_one_line(dog, spoil, message):
    spoil(dog)
    with pytest.raises(UserInputError, match=message) as caught:
        load_robot(dog / "robot.yaml")
    assert "\n" not in str(caught.value)
