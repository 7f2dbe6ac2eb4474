"""Suites: terrains that belong together, by one name."""

from quadpips_drake.errors import unknown_name
from quadpips_drake.terrain.library import terrain_names

_PAPER = ("ramp_10", "stairs", "sparse_stones")


def suite_names() -> list[str]:
    """Names of all suites, sorted."""
    return ["all", "paper"]


def suite_terrains(name: str, robot: str) -> list[str]:
    """The terrains of a suite for a robot, in its order; raises UserInputError for an unknown name."""
    if name == "paper":
        return list(_PAPER)
    if name == "all":
        return terrain_names()
    raise unknown_name("suite of terrains", name, suite_names())
