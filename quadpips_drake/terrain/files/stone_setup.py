"""Reads the JSON in which the authors of QuadPiPS describe a world: key `stone_setup`, lists `poses`, `scales`, `colors`."""

import math
from pathlib import Path

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, MAX_ELEMENTS, Box, Terrain, pose


def read_stone_setup(path: str | Path, start=None, goal=None, friction: float = DEFAULT_FRICTION) -> Terrain:
    """Returns the boxes in the file as a terrain named after it.

    Each pose is x, y, z [m], roll, pitch, yaw [rad] of a box's centre, each scale its length, width, height [m]. The format
    has no start and goal, so ``start`` (x, y, yaw) and ``goal`` (x, y) have to be given. Raises UserInputError.
    """

    def fail(key: str, reason: str):
        raise UserInputError(f"terrain file '{path}': {key}: {reason}")

    data = read_json(path, f"terrain file '{path}'")
    setup = data.get("stone_setup") if isinstance(data, dict) else None
    if not isinstance(setup, dict):
        fail("stone_setup", "missing; it must hold the lists 'poses' and 'scales'")
    lists = {key: setup.get(key) for key in ("poses", "scales")}
    for key, value in lists.items():
        if not isinstance(value, list) or not 1 <= len(value) <= MAX_ELEMENTS:
            fail(f"stone_setup.{key}", f"must be a list of 1 to {MAX_ELEMENTS} entries")
    if len(lists["poses"]) != len(lists["scales"]):
        fail("stone_setup.scales", f"has {len(lists['scales'])} entries but there are {len(lists['poses'])} poses")
    for key, value, meaning in (("start", start, "X,Y,YAW"), ("goal", goal, "X,Y")):
        if value is None:
            fail(key, f"this format has none; give --{key} {meaning}")
    boxes = []
    for i, (pose_row, scale_row) in enumerate(zip(lists["poses"], lists["scales"], strict=True)):
        for key, row, length in (("poses", pose_row, 6), ("scales", scale_row, 3)):
            if not isinstance(row, list) or len(row) != length or not all(_is_finite_number(value) for value in row):
                fail(f"stone_setup.{key}[{i}]", f"must be {length} finite numbers")
        try:
            boxes.append(Box(name=f"stone_{i}", size=scale_row, X_WE=pose(pose_row[:3], pose_row[3:])))
        except UserInputError as error:
            fail(f"stone_setup entry {i}", str(error))
    return Terrain(Path(path).stem, start, goal, friction, tuple(boxes))


def _is_finite_number(value) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False
