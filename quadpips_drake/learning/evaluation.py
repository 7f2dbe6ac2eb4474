"""Scores of a trained network on the test split of a dataset, with pictures."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from quadpips_drake.files import write_json
from quadpips_drake.learning.dataset import Frames, decode_depth
from quadpips_drake.learning.label_pictures import save_picture, sheet_of_frames, stack_sheets
from quadpips_drake.learning.metrics import class_iou, confusion_matrix, mean_iou, summary
from quadpips_drake.perception.steppability.exported_network import CLASSES
from quadpips_drake.perception.steppability.model import SteppabilityModel

REPORT, CONFUSION_PICTURE, WORST_PICTURE = "evaluation.json", "steppability_confusion.png", "steppability_worst_frames.png"
WORST = 16
"""Frames on the sheet of the worst."""
TIMED = 20
"""Images over which the inference time is taken."""


def evaluate_frames(
    model: SteppabilityModel, frames: Frames, *, clean: bool = False, on_frame: Callable[[int], None] = lambda count: None
) -> np.ndarray:
    """Returns a confusion matrix (true by predicted class) for each frame, (n, 3, 3).

    Counted are the pixels with a measurement and a truth: a label without a depth belongs to no point. ``clean``: on the
    images before corruption. ``on_frame`` is called with the number of frames done.
    """
    result = np.zeros((len(frames), len(CLASSES), len(CLASSES)), np.int64)
    for i in range(len(frames)):
        depth = decode_depth((frames.clean_depth if clean else frames.depth)[i])
        predicted = model.segment(depth, frames.down_C[i], frames.intrinsics)
        result[i] = confusion_matrix(frames.labels[i], predicted, np.isfinite(depth))
        on_frame(i + 1)
    return result


def score(model: SteppabilityModel, frames: Frames, on_frame: Callable[[int], None] = lambda count: None) -> dict:
    """Returns all figures of ``model`` on ``frames`` as plain values; "noisy" is what counts, "clean" is before corruption.

    ``confusion`` holds pixel counts, true by predicted class; ``per_frame`` (not for reports) those of each noisy frame.
    """
    noisy = evaluate_frames(model, frames, on_frame=on_frame)
    clean = evaluate_frames(model, frames, clean=True, on_frame=lambda count: on_frame(len(frames) + count))
    kinds = {
        name: _occurring_iou(noisy[frames.kind == k].sum(axis=0))
        for k, name in enumerate(frames.scene_kinds)
        if (frames.kind == k).any()
    }
    return {
        "frames": len(frames),
        "data_seed": frames.seeds[0],
        "noisy": summary(noisy.sum(axis=0)),
        "clean": summary(clean.sum(axis=0)),
        "mean_iou_by_scene": kinds,
        "inference_ms": round(1e3 * inference_time(model, frames), 1),
        "confusion": noisy.sum(axis=0).tolist(),
        "per_frame": noisy,
    }


def _occurring_iou(confusion: np.ndarray) -> float:
    """Mean IoU over the classes that occur (in a kind of scene without passable things there is nothing to find)."""
    return round(float(class_iou(confusion)[confusion.sum(axis=1) > 0].mean()), 4)


def inference_time(model: SteppabilityModel, frames: Frames) -> float:
    """Returns the median computing time [s] of one core from depth to labels of one image (other programs do not count)."""
    times = []
    for i in range(TIMED):
        depth = decode_depth(frames.depth[i % len(frames)])
        started = time.process_time()
        model.segment(depth, frames.down_C[i % len(frames)], frames.intrinsics)
        times.append(time.process_time() - started)
    return float(np.median(times))


def frame_errors(per_frame: np.ndarray) -> np.ndarray:
    """Returns the share of wrong pixels of each frame, (n,); frames with less than 1000 counted pixels have zero."""
    total = per_frame.sum(axis=(1, 2))
    wrong = total - np.trace(per_frame, axis1=1, axis2=2)
    return np.where(total >= 1000, wrong / np.maximum(total, 1), 0.0)


def save_report(scores: dict, model: SteppabilityModel, frames: Frames, directory: Path) -> None:
    """Writes evaluation.json, the picture of the confusion matrix and the sheet with the worst frames."""
    per_frame = scores["per_frame"]
    plain = {key: value for key, value in scores.items() if key != "per_frame"}
    write_json(Path(directory) / REPORT, plain)
    save_confusion_picture(per_frame.sum(axis=0), Path(directory) / CONFUSION_PICTURE)
    errors = frame_errors(per_frame)
    worst = np.argsort(-errors)[:WORST]
    save_picture(Path(directory) / WORST_PICTURE, sheet_of_predictions(model, frames, worst, errors))


def sheet_of_predictions(model: SteppabilityModel, frames: Frames, chosen, errors: np.ndarray) -> np.ndarray:
    """Returns a contact sheet of the frames ``chosen`` with the network's labels; titles say the share of wrong pixels."""
    sheets = []
    for first in range(0, len(chosen), 8):
        part = chosen[first : first + 8]
        predicted = [model.segment(decode_depth(frames.depth[i]), frames.down_C[i], frames.intrinsics) for i in part]
        titles = [f"{frames.scene_kinds[frames.kind[i]]} {100 * errors[i]:.1f}% wrong" for i in part]
        sheets.append(sheet_of_frames(frames, part, predicted, titles))
    return stack_sheets(sheets)


def save_confusion_picture(confusion: np.ndarray, path: Path) -> None:
    """Draws a confusion matrix as PNG: rows are the truth and sum to one."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    share = confusion / np.maximum(confusion.sum(axis=1, keepdims=True), 1)
    figure = Figure(figsize=(4.6, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.imshow(share, cmap="Greens", vmin=0, vmax=1)
    names = [name.replace("_", "-") for name in CLASSES]
    axes.set_xticks(range(len(names)), names)
    axes.set_yticks(range(len(names)), names)
    axes.set(xlabel="network", ylabel="truth", title=f"Share of the true pixels; mean IoU {mean_iou(confusion):.3f}")
    for i in range(len(names)):
        for j in range(len(names)):
            color = "white" if share[i, j] > 0.5 else "black"
            axes.text(j, i, f"{share[i, j]:.3f}", ha="center", va="center", color=color)
    figure.savefig(path, dpi=110)
