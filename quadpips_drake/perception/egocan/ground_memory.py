"""The ground that the egocan remembers: a window of square cells fixed to the world that travels with the robot."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.assumed_ground import AssumedGroundConfig, assumed_plane
from quadpips_drake.perception.egocan import ground_kernels as kernels
from quadpips_drake.perception.egocan.view_kernels import pack_camera
from quadpips_drake.perception.scrolling import shifted
from quadpips_drake.values.images import AffordanceImage
from quadpips_drake.values.immutable import ImmutableValue

_FIELDS = ("height", "normal", "label", "votes", "count", "missed")
"""Of GroundMemory: the arrays that scroll, in the order in which the kernels take them."""


@configuration
class GroundMemoryConfig(AssumedGroundConfig):
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
    return [first_cell, *(shifted(getattr(memory, name), *shift.tolist()) for name in _FIELDS)]


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

    Where, see ``assumed_plane``; cells that are known are left alone.
    """
    n = len(memory.height)
    x = (memory.first_cell[0] + np.arange(n) + 0.5)[:, None] * config.cell
    y = (memory.first_cell[1] + np.arange(n) + 0.5)[None, :] * config.cell
    cameras = [(image.X_WC, image.intrinsics) for image in images]
    z, normal, chosen = assumed_plane(x, y, cameras, X_WB, p_WG, config)
    chosen &= np.isnan(memory.height)
    height, normals = np.array(memory.height), np.array(memory.normal)
    height[chosen] = z[chosen]
    normals[chosen] = normal
    return dataclasses.replace(memory, height=height, normal=normals)
