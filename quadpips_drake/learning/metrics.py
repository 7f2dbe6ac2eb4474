"""Scores of predicted steppability: confusion, intersection over union, recall."""

import numpy as np

from quadpips_drake.perception.steppability.exported_network import CLASSES


def confusion_matrix(truth: np.ndarray, predicted: np.ndarray, counted: np.ndarray | None = None) -> np.ndarray:
    """Returns pixel counts (3, 3), true class by predicted class, int64.

    Args:
        truth, predicted: values of Steppability, any shape. Pixels without truth (UNKNOWN) do not count.
        counted: which pixels count, bool; by default all.
    """
    known = truth > 0 if counted is None else (truth > 0) & counted
    size = len(CLASSES)
    pairs = (truth[known].astype(np.int64) - 1) * size + np.clip(predicted[known].astype(np.int64) - 1, 0, size - 1)
    return np.bincount(pairs, minlength=size * size).reshape(size, size)


def class_iou(confusion: np.ndarray) -> np.ndarray:
    """Returns the intersection over union of each class, (3,); NaN for a class that neither occurs nor is predicted."""
    hits = np.diag(confusion).astype(float)
    union = confusion.sum(axis=0) + confusion.sum(axis=1) - hits
    return np.divide(hits, union, out=np.full(len(hits), np.nan), where=union > 0)


def class_recall(confusion: np.ndarray) -> np.ndarray:
    """Returns the share of each class's pixels that are found, (3,); NaN for a class that does not occur."""
    hits, total = np.diag(confusion).astype(float), confusion.sum(axis=1)
    return np.divide(hits, total, out=np.full(len(hits), np.nan), where=total > 0)


def mean_iou(confusion: np.ndarray) -> float:
    """Returns the mean over the classes of the intersection over union."""
    return float(np.nanmean(class_iou(confusion)))


def summary(confusion: np.ndarray) -> dict:
    """Returns all scores by name, rounded, for reports."""
    iou, recall = class_iou(confusion), class_recall(confusion)
    return {
        "mean_iou": round(mean_iou(confusion), 4),
        "iou": {name: _rounded(value) for name, value in zip(CLASSES, iou, strict=True)},
        "recall": {name: _rounded(value) for name, value in zip(CLASSES, recall, strict=True)},
        "accuracy": _rounded(np.trace(confusion) / max(confusion.sum(), 1)),
    }


def _rounded(value: float) -> float | None:
    return round(float(value), 4) if np.isfinite(value) else None
