"""Reads triangles from Wavefront .obj files (vertices and faces; everything else in them is skipped)."""

from pathlib import Path

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_text
from quadpips_drake.terrain.terrain import MAX_ELEMENTS

MAX_OBJ_BYTES = 20_000_000


def read_obj(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices (n, 3) float and triangles (m, 3) int; polygons are split into fans. Raises UserInputError."""
    path = Path(path)
    if path.suffix.lower() != ".obj":
        raise UserInputError(f"'{path.name}' is not an .obj file")
    lines = read_text(path, f"'{path}'", MAX_OBJ_BYTES).splitlines()
    vertices, triangles = [], []
    for number, line in enumerate(lines, start=1):
        words = line.split()
        try:
            if words and words[0] == "v":
                x, y, z = (float(word) for word in words[1:4])
                vertices.append((x, y, z))
            elif words and words[0] == "f":
                triangles += _fan([_vertex_index(word, len(vertices)) for word in words[1:]])
        except ValueError:
            raise UserInputError(f"'{path}', line {number}: cannot be understood: '{line[:40]}'") from None
        if len(triangles) > MAX_ELEMENTS:
            raise UserInputError(f"'{path}' has more than {MAX_ELEMENTS} triangles")
    if not triangles:
        raise UserInputError(f"'{path}' holds no faces")
    return np.array(vertices), np.array(triangles)


def _vertex_index(word: str, count: int) -> int:
    """Index from 0 on of a face's corner such as '3', '3/1/2' or '-1' (counted from the end)."""
    index = int(word.split("/")[0])
    index = index - 1 if index > 0 else count + index
    if not 0 <= index < count:
        raise ValueError(word)
    return index


def _fan(corners: list[int]) -> list[tuple[int, int, int]]:
    if len(corners) < 3:
        raise ValueError("a face needs three corners")
    return [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
