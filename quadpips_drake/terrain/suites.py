"""Which terrains belong together: the members of a suite, by its name, for a robot."""

from quadpips_drake.errors import unknown_name
from quadpips_drake.terrain.library import terrain_names

_STAIRS = {"go2": "stairs", "anymal_c": "stairs_10"}
"""A small robot climbs 5 cm, a large one 10 cm."""
_DEFAULT_STAIRS = "stairs"
_LARGE_ONLY = ("open_stairs_10", "parallel_beams", "stairs_10")
"""Nothing for a robot as small as the Go2."""
_GO2_HARDWARE = (
    "go2_flat",
    "go2_single_platform",
    "go2_double_platform",
    "go2_ramped_platform",
    "go2_triple_platform",
    "go2_ramped_stones",
)
_CURVES = ("balance_beam", "gap", "stairs", "ramp_10", "sparse_stones")
_GAPS = ("gaps_symmetric", "gaps_staggered", "gaps_and_steps")


def suite_names() -> tuple[str, ...]:
    """Names of the suites.

    ``paper``: the ten environments of QuadPiPS (2026), section VIII; ``all``: every terrain that is made for the robot;
    ``go2_hardware``: the six setups in which the Go2 walked; ``curves``: those whose difficulties are published as curves;
    ``gaps``: the scenarios I to III of Taouil et al. (2023).
    """
    return ("all", "curves", "gaps", "go2_hardware", "paper")


def suite_terrains(name: str, robot: str) -> tuple[str, ...]:
    """Returns the names of the terrains of the suite ``name`` for ``robot``, in the order of tables.

    Raises:
        UserInputError: there is no such suite.
    """
    if name == "paper":
        return _paper(robot)
    if name == "curves":
        return _CURVES
    if name == "gaps":
        return _GAPS
    if name == "go2_hardware":
        return _GO2_HARDWARE
    if name == "all":
        others = _LARGE_ONLY if robot == "go2" else _GO2_HARDWARE
        return tuple(terrain for terrain in terrain_names() if terrain not in others)
    raise unknown_name("suite", name, list(suite_names()))


def _paper(robot: str) -> tuple[str, ...]:
    return (
        "ramp_10",
        _STAIRS.get(robot, _DEFAULT_STAIRS),
        "rubble",
        "pegboard",
        "balance_beam",
        "ramped_balance_beam",
        "ramped_stepping_stones",
        "sparse_stones",
        "obstructed_balance_beam",
        "winding_balance_beam",
    )
