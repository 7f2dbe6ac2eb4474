"""The ground that the egocan remembers: a window of square cells fixed to the world that travels with the robot."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.egocan import ground_kernels as kernels
from quadpips_drake.perception.egocan.view_kernels import pack_camera
from quadpips_drake.values.images import AffordanceImage
from quadpips_drake.values.immutable import ImmutableValue

_FIELDS = ("height", "normal", "label", "votes", "count", "missed")
"""Of GroundMemory: the arrays that scroll, in the order in which the kernels take them."""


@configuration
class GroundMemoryConfig:
    """Parameters of the remembered ground."""

    cell: float = ranged(0.01, 0.002, 0.1)
    """Side of a cell [m]."""
    half_extent: float = ranged(1.75, 0.02, 50.0)
    """The window reaches this far from the camera in x and y of the world [m]."""
    blend_height: float = ranged(0.02, 0.001, 1.0)
    """New measurements within this distance of the remembered height are averaged with it, others replace it [m]."""
    layer: float = ranged(0.03, 0.001, 1.0)
    """Points of one image in one cell that are further apart in height than this belong to two surfaces; the higher one
    counts [m]."""
    see_through: float = ranged(0.04, 0.001, 1.0)
    """A remembered point is forgotten when the camera sees this much further past it [m]."""
    trusted_share: float = ranged(0.8, 0.0, 1.0)
    """A surface counts as ground when at least this share of the latest images that show its place measured it; 0: once is
    enough."""
    assumed_behind: float = ranged(0.8, 0.0, 50.0)
    """Flat ground is assumed at the start from here behind the base origin [m] ..."""
    assumed_ahead: float = ranged(1.2, 0.0, 50.0)
    """... to here ahead of it, or to where the camera begins to see, whichever is nearer [m]."""
    assumed_half_width: float = ranged(0.5, 0.0, 50.0)
    """... and to this distance to either side [m]. Zero in all three: nothing is assumed."""

    def __post_init__(self):
        if not 10 * self.cell <= self.half_extent <= 500 * self.cell:
            raise UserInputError(f"half_extent must be 10 to 500 cells of {self.cell:g} m, not {self.half_extent:g} m")

    @property
    def cells(self) -> int:
        """Cells along one side of the window."""
        return 2 * round(self.half_extent / self.cell)


@dataclass(frozen=True, eq=False)
class GroundMemory(ImmutableValue):
    """Heights and normals of ground in W; cell (i, j) covers x in [cell (first_cell[0] + i), + cell), y likewise with j."""

    first_cell: np.ndarray
    """World indices of cell (0, 0), int64 (2,)."""
    height: np.ndarray
    """z of the surface [m], float32 (n, n); NaN where unknown."""
    normal: np.ndarray
    """Upward unit normal, float32 (n, n, 3)."""
    label: np.ndarray
    """Steppability, uint8 (n, n). It stays with the surface: an image without a label for it changes nothing."""
    votes: np.ndarray
    """Images that speak for the label, less those that spoke against it, uint8 (n, n); 0 where it is UNKNOWN."""
    count: np.ndarray
    """Of the last MAX_COUNT images or so that showed the cell's place, those that measured its surface, uint8 (n, n); 0
    where unknown or assumed."""
    missed: np.ndarray
    """And those that showed the place, but not the surface, uint8 (n, n)."""

    @staticmethod
    def empty(config: GroundMemoryConfig) -> "GroundMemory":
        """Returns a window in which nothing is known."""
        n = config.cells
        return GroundMemory(
            first_cell=np.full(2, -n // 2, np.int64),
            height=np.full((n, n), np.nan, np.float32),
            normal=np.full((n, n, 3), np.nan, np.float32),
            label=np.zeros((n, n), np.uint8),
            votes=np.zeros((n, n), np.uint8),
            count=np.zeros((n, n), np.uint8),
            missed=np.zeros((n, n), np.uint8),
        )

    def trusted_height(self, config: GroundMemoryConfig) -> np.ndarray:
        """Returns ``height`` without the cells that were missed too often, float32 (n, n).

        Noise throws a few points past every edge; over many images, all cells along it would become ground.
        """
        trusted = self.count >= config.trusted_share * (self.count + self.missed)
        return np.where(trusted, self.height, np.float32(np.nan))


def scroll_to(memory: GroundMemory, p_WC: np.ndarray, config: GroundMemoryConfig) -> GroundMemory:
    """Returns the window around ``p_WC`` [m] with the cells that it shares with ``memory``."""
    return GroundMemory(*_scrolled(memory, p_WC, config))


def _scrolled(memory: GroundMemory, p_WC: np.ndarray, config: GroundMemoryConfig) -> list[np.ndarray]:
    """Returns the fields of the window around ``p_WC`` [m] as fresh arrays, which may be written to."""
    n = config.cells
    first_cell = np.floor(p_WC[:2] / config.cell).astype(np.int64) - n // 2
    shift = first_cell - memory.first_cell
    return [first_cell, *(_shifted(getattr(memory, name), *shift.tolist()) for name in _FIELDS)]


def _shifted(old: np.ndarray, down: int, right: int) -> np.ndarray:
    """Returns a fresh array whose element (i, j) is ``old``'s (i + down, j + right); unknown where ``old`` has none."""
    n, nothing = len(old), np.nan if old.dtype == np.float32 else 0
    if max(abs(down), abs(right)) >= n:
        return np.full(old.shape, nothing, old.dtype)
    fresh = np.empty(old.shape, old.dtype)
    top, bottom, left, end = max(-down, 0), n - max(down, 0), max(-right, 0), n - max(right, 0)
    fresh[top:bottom, left:end] = old[top + down : bottom + down, left + right : end + right]
    fresh[:top], fresh[bottom:] = nothing, nothing
    fresh[:, :left], fresh[:, end:] = nothing, nothing
    return fresh


def measure_ground(
    memory: GroundMemory, images: Sequence[AffordanceImage], p_WC: np.ndarray, config: GroundMemoryConfig
) -> GroundMemory:
    """Returns ``memory``, scrolled to ``p_WC`` [m], with what ``images`` show; the rules are those of ``merge_ground``.

    A cell takes the highest surface that an image shows in it.
    """
    first_cell, *ground = _scrolled(memory, p_WC, config)
    shape = ground[0].shape
    for image in images:
        if image.depth.size == 0:
            continue
        total, label = np.zeros((*shape, 6), np.float32), np.zeros(shape, np.uint8)
        camera = pack_camera(image.X_WC, image.intrinsics)
        kernels.collect_ground(
            image.depth, image.normals, image.labels, camera, first_cell, config.cell, config.layer, total, label
        )
        rule = (config.blend_height, config.see_through, config.trusted_share)
        kernels.merge_ground(total, label, image.depth, camera, first_cell, config.cell, rule, tuple(ground))
    return GroundMemory(first_cell, *ground)


def assume_ground(
    memory: GroundMemory,
    images: Sequence[AffordanceImage],
    X_WB: np.ndarray,
    p_WG: np.ndarray,
    config: GroundMemoryConfig,
) -> GroundMemory:
    """Returns ``memory`` with the plane through the ground points ``p_WG`` [m], (4, 3), laid around the base.

    Cells that lie in a camera's field of view are left alone, whether or not its image shows anything there. Feet that are
    nowhere (NaN) carry no assumption.
    """
    if not (np.isfinite(p_WG).all() and np.isfinite(X_WB).all()):
        return memory
    center = p_WG.mean(axis=0)
    basis = np.column_stack([p_WG[:, 0] - center[0], p_WG[:, 1] - center[1]])
    slope, *_ = np.linalg.lstsq(basis, p_WG[:, 2] - center[2], rcond=None)
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1.0 + slope @ slope)
    n = len(memory.height)
    x = (memory.first_cell[0] + np.arange(n) + 0.5)[:, None] * config.cell
    y = (memory.first_cell[1] + np.arange(n) + 0.5)[None, :] * config.cell
    z = center[2] + slope[0] * (x - center[0]) + slope[1] * (y - center[1])
    heading = X_WB[:2, 0] / np.linalg.norm(X_WB[:2, 0])
    ahead = heading[0] * (x - X_WB[0, 3]) + heading[1] * (y - X_WB[1, 3])
    aside = heading[0] * (y - X_WB[1, 3]) - heading[1] * (x - X_WB[0, 3])
    chosen = (ahead > -config.assumed_behind) & (ahead < config.assumed_ahead)
    chosen &= np.abs(aside) < config.assumed_half_width
    chosen &= np.isnan(memory.height)
    for image in images:
        chosen &= ~_in_view(x, y, z, image)
    height, normals = np.array(memory.height), np.array(memory.normal)
    height[chosen] = z[chosen]
    normals[chosen] = normal
    return dataclasses.replace(memory, height=height, normal=normals)


def _in_view(x: np.ndarray, y: np.ndarray, z: np.ndarray, image: AffordanceImage) -> np.ndarray:
    """Whether the camera's field of view contains the points (x, y, z) of W [m]."""
    R_CW, p_WC, k = image.X_WC[:3, :3].T, image.X_WC[:3, 3], image.intrinsics
    d = (x - p_WC[0], y - p_WC[1], z - p_WC[2])
    p_C = [row[0] * d[0] + row[1] * d[1] + row[2] * d[2] for row in R_CW]
    front = p_C[2] > 1e-6
    depth = np.where(front, p_C[2], 1.0)
    u, v = k.fx * p_C[0] / depth + k.cx, k.fy * p_C[1] / depth + k.cy
    return front & (u >= 0) & (u <= k.width - 1) & (v >= 0) & (v <= k.height - 1)
