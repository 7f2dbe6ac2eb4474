"""The terrains that come with the package, by name: what the functions of ``environments/`` make.

Geometry, sources, starts and goals are told in docs/environments.md. Robots walk in +x, on the ramped worlds in -x.
"""

from pathlib import Path

from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.framework.registry import Registry
from quadpips_drake.terrain.environments.beams import balance_beam, obstructed_balance_beam, offset_beam, parallel_beams
from quadpips_drake.terrain.environments.boulders import boulders
from quadpips_drake.terrain.environments.difficulty import Difficulty, difficulty_of
from quadpips_drake.terrain.environments.flat import flat
from quadpips_drake.terrain.environments.gaps import gap, gaps_and_steps, gaps_staggered, gaps_symmetric
from quadpips_drake.terrain.environments.go2_hardware import (
    go2_double_platform,
    go2_flat,
    go2_ramped_platform,
    go2_ramped_stones,
    go2_single_platform,
    go2_triple_platform,
)
from quadpips_drake.terrain.environments.ramped_beam import ramped_balance_beam, ramped_balance_beam_easy
from quadpips_drake.terrain.environments.ramped_stones import ramped_stepping_stones, ramped_stepping_stones_easy
from quadpips_drake.terrain.environments.ramps import down_ramp, ramp_10, slope
from quadpips_drake.terrain.environments.stairs import open_stairs, open_stairs_10, stairs, stairs_10
from quadpips_drake.terrain.environments.stones import irregular_stones, sparse_stones, stepping_stones
from quadpips_drake.terrain.environments.uneven import bumps, pegboard, rubble
from quadpips_drake.terrain.environments.views import cameras_of
from quadpips_drake.terrain.environments.winding_beam import winding_balance_beam, winding_balance_beam_hard
from quadpips_drake.terrain.files.stone_setup import read_stone_setup
from quadpips_drake.terrain.files.terrain_file import read_terrain_file
from quadpips_drake.terrain.terrain import Terrain

_ENVIRONMENTS = (
    balance_beam, boulders, bumps, down_ramp, flat, gap, gaps_and_steps, gaps_staggered, gaps_symmetric,
    go2_double_platform, go2_flat, go2_ramped_platform, go2_ramped_stones, go2_single_platform, go2_triple_platform,
    irregular_stones, obstructed_balance_beam, offset_beam, open_stairs, open_stairs_10, parallel_beams, pegboard, ramp_10,
    ramped_balance_beam, ramped_balance_beam_easy,
    ramped_stepping_stones, ramped_stepping_stones_easy, rubble, slope, sparse_stones, stairs, stairs_10,
    stepping_stones, winding_balance_beam, winding_balance_beam_hard,
)  # fmt: skip

terrains = Registry("terrain", "quadpips_drake.terrains")
"""``factory(seed=...)`` returns a Terrain; its docstring's first line is what lists say."""

for _generator in _ENVIRONMENTS:
    terrains.add(_generator.__name__, _generator)


def terrain_names() -> list[str]:
    """Names that ``load_terrain`` knows, sorted."""
    return terrains.names()


def load_terrain(name_or_path: str, seed: int = 0, start=None, goal=None, difficulty: float | None = None) -> Terrain:
    """Returns a terrain of the library by name, or reads one from a file (.yaml, .yml, or the authors' .json).

    ``seed`` decides what is random in a library terrain. ``start`` (x, y, yaw) and ``goal`` (x, y), when given, replace
    those of the terrain; a .json file has none of its own. ``difficulty`` is the one number that makes a library terrain
    easy or hard, see ``terrain_difficulty``. Raises UserInputError with one line for whatever is wrong.
    """
    text = str(name_or_path)
    suffix = Path(text).suffix.lower()
    if text in terrains:
        return _with_ends(terrains.get(text).factory(seed=seed, **_chosen(text, difficulty)), start, goal)
    if difficulty is not None and (suffix or "/" in text):
        raise UserInputError(f"difficulty {difficulty:g}: a terrain file has none ('{text}'); take a terrain of the library")
    if suffix in (".yaml", ".yml"):
        return read_terrain_file(text, start, goal)
    if suffix == ".json":
        return read_stone_setup(text, start, goal)
    if suffix or "/" in text:
        raise UserInputError(f"terrain file '{text}': the name must end in .yaml, .yml or .json")
    raise unknown_name("terrain", text, terrain_names())


def terrain_difficulty(name: str) -> Difficulty | None:
    """What makes the library terrain ``name`` easy or hard; None where there is nothing to choose."""
    return difficulty_of(terrains.get(name).factory)


def terrain_cameras(name_or_path: str) -> tuple[str, ...]:
    """Cameras that a robot needs there beside the front one; those of a terrain that is not in the library: none."""
    return cameras_of(terrains.get(name_or_path).factory) if name_or_path in terrains else ()


def _chosen(name: str, difficulty: float | None) -> dict[str, float]:
    """The keyword by which a terrain gets its difficulty."""
    if difficulty is None:
        return {}
    kind = terrain_difficulty(name)
    if kind is None:
        raise UserInputError(f"terrain '{name}' has no difficulty to choose; 'quadpips terrain list' says which have one")
    return {kind.parameter: kind.check(name, difficulty)}


def _with_ends(terrain: Terrain, start, goal) -> Terrain:
    if start is None and goal is None:
        return terrain
    start = terrain.start if start is None else start
    goal = terrain.goal if goal is None else goal
    return Terrain(terrain.name, start, goal, terrain.friction, terrain.elements)
