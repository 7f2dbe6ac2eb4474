"""Pictures of labelled depth images."""

from pathlib import Path

import cv2
import numpy as np

from quadpips_drake.learning.dataset import Frames, decode_depth
from quadpips_drake.values.steppability import Steppability

LABEL_COLORS = {
    Steppability.UNKNOWN: (40, 40, 40),
    Steppability.STEPPABLE: (70, 170, 80),
    Steppability.PASSABLE: (240, 200, 60),
    Steppability.NON_PASSABLE: (210, 60, 60),
}
"""Red, green, blue."""
_GUTTER = 4


def label_picture(labels: np.ndarray) -> np.ndarray:
    """Returns labels (height, width) as an RGB image: green, yellow, red; unknown is dark grey."""
    table = np.array([LABEL_COLORS[Steppability(value)] for value in range(4)], np.uint8)
    return table[np.minimum(labels, 3)]


def depth_picture(depth: np.ndarray, max_range: float = 3.0) -> np.ndarray:
    """Returns depth [m], NaN where invalid, as an RGB image; invalid pixels are black."""
    scaled = np.nan_to_num(255 * (1 - 0.8 * depth / max_range), nan=0.0)
    colored = cv2.applyColorMap(np.clip(scaled, 0, 255).astype(np.uint8), cv2.COLORMAP_VIRIDIS)[:, :, ::-1].copy()
    colored[~np.isfinite(depth)] = 0
    return colored


def contact_sheet(columns: list[list[np.ndarray]], titles: list[str], legends: list[str]) -> np.ndarray:
    """Returns RGB images side by side, ``columns[i][j]`` in column i and row j; all of one size.

    ``titles`` stand above the columns, ``legends`` at the left of the rows.
    """
    height, width = columns[0][0].shape[:2]
    rows = len(columns[0])
    left, top = 86, 18
    sheet = np.full((top + rows * (height + _GUTTER), left + len(columns) * (width + _GUTTER), 3), 255, np.uint8)
    for i, column in enumerate(columns):
        x = left + i * (width + _GUTTER)
        _write(sheet, titles[i], (x, 13))
        for j, image in enumerate(column):
            y = top + j * (height + _GUTTER)
            sheet[y : y + height, x : x + width] = image
    for j, legend in enumerate(legends):
        _write(sheet, legend, (2, top + j * (height + _GUTTER) + height // 2))
    return sheet


def sheet_of_frames(frames: Frames, indices, predictions: list[np.ndarray] | None = None, titles=None) -> np.ndarray:
    """Returns a contact sheet: measured depth, truth and, where given, the predicted labels of the frames ``indices``."""
    columns, names = [], []
    for k, index in enumerate(indices):
        column = [depth_picture(decode_depth(frames.depth[index])), label_picture(frames.labels[index])]
        if predictions is not None:
            column.append(label_picture(predictions[k]))
        columns.append([cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_NEAREST) for image in column])
        names.append(frames.scene_kinds[frames.kind[index]] if titles is None else titles[k])
    legends = ["depth", "truth", "network"][: len(columns[0])]
    return contact_sheet(columns, names, legends)


def stack_sheets(sheets: list[np.ndarray]) -> np.ndarray:
    """Returns contact sheets, one below the other, on white."""
    width = max(sheet.shape[1] for sheet in sheets)
    padded = [np.pad(s, ((0, 10), (0, width - s.shape[1]), (0, 0)), constant_values=255) for s in sheets]
    return np.concatenate(padded)


def save_picture(path: Path, image: np.ndarray) -> None:
    """Writes an RGB image (height, width, 3) as PNG."""
    cv2.imwrite(str(path), image[:, :, ::-1])


def _write(image: np.ndarray, text: str, at: tuple[int, int]) -> None:
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.4, (0, 0, 0), 1, cv2.LINE_AA)
