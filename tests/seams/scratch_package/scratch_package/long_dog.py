"""A robot: Unitree's Go2 with other drives, its files beside this one."""

from pathlib import Path


def robot_file() -> Path:
    """The robot.yaml."""
    return Path(__file__).parent / "long_dog.yaml"
