"""Debug pictures of one moment of the perception."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from quadpips_drake.values.images import AffordanceImage, EgocanImage, SuperpixelImage
from quadpips_drake.values.regions import RegionSet


def save_perception_picture(
    path: str | Path,
    image: AffordanceImage,
    can: EgocanImage,
    superpixels: SuperpixelImage,
    regions: RegionSet,
    X_WB: np.ndarray | None = None,
) -> None:
    """Writes a PNG with depth, normals, cap height, egocylinder, superpixels and regions; forward (z of E) is up.

    ``X_WB``: pose of the base, (4, 4), drawn as a cross with a line forward among the regions.
    """
    figure = Figure(figsize=(18, 11), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 3)
    if image.depth.size:
        _show(axes[0, 0], np.where(np.isfinite(image.depth), image.depth, np.nan), "depth [m]", figure)
        axes[0, 1].imshow(np.nan_to_num(np.abs(image.normals)))
        axes[0, 1].set_title("|normals| in C as RGB")
    if can.cap_height.size:
        _show(axes[0, 2], can.cap_height, "floor cap: depth below the camera [m]", figure, origin="lower")
        _show(axes[1, 0], can.cylinder_range, "egocylinder: range [m]", figure)
        _show_superpixels(axes[1, 1], superpixels)
    _show_regions(axes[1, 2], can, regions, X_WB)
    figure.suptitle(f"t = {image.stamp:.3f} s, {len(superpixels.centers)} superpixels, {len(regions.regions)} regions")
    figure.savefig(path, dpi=70)


def _show(axis, array, title, figure, **options):
    figure.colorbar(axis.imshow(array, **options), ax=axis, shrink=0.7)
    axis.set_title(title)


def _show_superpixels(axis, superpixels: SuperpixelImage):
    """Clusters in shuffled colours; healthy pixels without a cluster in grey."""
    assignment = superpixels.assignment
    colors = np.random.default_rng(0).uniform(0.25, 1.0, (max(len(superpixels.centers), 1), 3))
    picture = np.zeros((*assignment.shape, 3))
    picture[superpixels.healthy] = 0.3
    picture[assignment >= 0] = colors[assignment[assignment >= 0]]
    axis.imshow(picture, origin="lower")
    axis.set_title("superpixels (grey: healthy, without cluster)")


def _show_regions(axis, can: EgocanImage, regions: RegionSet, X_WB):
    """Boundaries, insets and candidates from above; x of W to the right."""
    for region in regions.regions:
        for polygon, color in ((region.boundary, "0.6"), (region.inset, "tab:blue")):
            corners = region.X_WR[:3, :2] @ polygon.T + region.X_WR[:3, 3:]
            axis.fill(corners[0], corners[1], facecolor="none", edgecolor=color, linewidth=0.8)
        axis.plot(*region.center[:2], ".", color="tab:red", markersize=3)
    if can.cap_height.size:
        axis.plot(*can.X_WE[:2, 3], "k+", markersize=10)
    if X_WB is not None:
        axis.plot([X_WB[0, 3], X_WB[0, 3] + 0.3 * X_WB[0, 0]], [X_WB[1, 3], X_WB[1, 3] + 0.3 * X_WB[1, 0]], "k-")
        axis.plot(*X_WB[:2, 3], "kx", markersize=10)
    axis.set_aspect("equal")
    axis.set_title("regions in W [m] (+ camera, x base)")
