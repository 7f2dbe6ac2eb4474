"""Holds the logs of two results against each other, to the bit: ``python -m tests.compare_logs DIR_A DIR_B [--prefix]``.

Each argument is a directory with a ``log.npz`` or such a file. Arrays must have the same names, types and numbers; NaN
equals NaN, and 0.0 is not -0.0. ``--prefix`` compares a trial with a longer one of the same kind: only the samples that both
have (and of footholds, those that touch down within both). Status 0: equal; 1: different; 2: cannot be compared.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

OTHERS = {"foothold_": "foothold_touchdown", "note_": "note_time", "appeared_": "appeared_time"}
"""How the names of arrays begin that have rows of their own, and which of them has their times; all others have one row for
each sample of ``time``."""


def read_log(place: Path) -> dict[str, np.ndarray]:
    """The arrays of a log, by name."""
    path = place / "log.npz" if place.is_dir() else place
    with np.load(path) as log:
        return {name: log[name] for name in log.files}


def cut(log: dict[str, np.ndarray], until: float) -> dict[str, np.ndarray]:
    """The log of the same trial if it had ended at ``until`` [s]."""
    samples = log["time"] <= until
    # A plan made after the end has no touch-down before it.
    kept = {kind: log.get(times, np.zeros(0)) <= until for kind, times in OTHERS.items()}

    def rows(name: str) -> np.ndarray:
        return next((mask for kind, mask in kept.items() if name.startswith(kind)), samples)

    return {name: array[rows(name)] for name, array in log.items()}


def differences(a: dict[str, np.ndarray], b: dict[str, np.ndarray], prefix: bool = False) -> list[str]:
    """One line for each array that differs: where first, and by how much at most; empty if the logs are equal."""
    if prefix:
        until = min(a["time"][-1], b["time"][-1])
        a, b = cut(a, until), cut(b, until)
    lines = [f"{name}: only in one of the logs" for name in sorted(a.keys() ^ b.keys())]
    for name in [name for name in a if name in b]:
        one, other = a[name], b[name]
        if one.dtype.kind == other.dtype.kind == "U":  # as long as the longest text
            one, other = (array.astype(object) for array in (one, other))
        if one.dtype != other.dtype or one.shape != other.shape:
            lines.append(f"{name}: {one.dtype}{list(one.shape)} and {other.dtype}{list(other.shape)}")
            continue
        different = _bits(one) != _bits(other)
        if one.dtype.kind == "f":
            different &= ~(np.isnan(one) & np.isnan(other))
        if different.any():
            first = np.unravel_index(np.argmax(different), one.shape)
            where = "".join(f"[{i}]" for i in first)
            count = f"{different.sum()} of {different.size} differ{_largest_gap(one, other)}"
            lines.append(f"{name}{where}: {one[first]!s} and {other[first]!s}; {count}")
    return lines


def _largest_gap(one: np.ndarray, other: np.ndarray) -> str:
    """By how much numbers differ, in words; nothing for texts."""
    if one.dtype.kind == "O":
        return ""
    return f", by {np.nanmax(np.abs(one.astype(float) - other.astype(float)), initial=0.0):.3g} at most"


def _bits(array: np.ndarray) -> np.ndarray:
    """Floating point numbers as the integers of the same bits; anything else as it is."""
    return np.ascontiguousarray(array).view(f"i{array.itemsize}") if array.dtype.kind == "f" else array


def main(arguments: list[str] | None = None) -> int:
    """Prints what differs and returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.compare_logs", description="Compare two logs to the bit.")
    parser.add_argument("places", nargs=2, type=Path, metavar="DIR", help="directory with a log.npz, or the file")
    parser.add_argument("--prefix", action="store_true", help="only what both logs have, where one trial lasted longer")
    options = parser.parse_args(arguments)
    try:
        a, b = (read_log(place) for place in options.places)
    except (OSError, ValueError) as error:
        print(f"cannot be compared: {error}", file=sys.stderr)
        return 2
    lines = differences(a, b, options.prefix)
    samples = min(len(a["time"]), len(b["time"]))
    print("\n".join(lines) if lines else f"equal: {len(a)} arrays, {samples} samples")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
