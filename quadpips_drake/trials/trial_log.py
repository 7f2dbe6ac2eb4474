"""log.npz: what happened, sampled at a fixed rate; holds simulated quantities only, so the same seed gives the same bits."""

from pathlib import Path

import numpy as np

from quadpips_drake.files import replacing
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.robot_state import RobotState

MAX_NOTES = 2000
"""Notes that are kept; of more than these, the first and the last."""
_FIRST_NOTES = 200
_BLOCK = 1000


class TrialLog:
    """Grows by one row per sample; every array has the sample as its first axis, but for those of footholds, of notes and of
    what has appeared."""

    def __init__(self, keep: int | None = None):
        """``keep``: how many samples are kept, the newest ones; None: all."""
        self.keep_references = True
        """Whether to collect references as they are published; never rolling ones, which supersede each other too fast."""
        self._keep = keep
        self._samples: tuple[list[dict], list[dict]] = [], []
        """Blocks of _BLOCK samples each, stacked, and the rows of the samples after them."""
        self.references: list = []
        """Each published WholeBodyReference once, in order; rolling ones supersede each other too fast for that."""
        self.notes: list[tuple[float, str, str]] = []
        """(time [s], who, what): what systems said in words."""
        self.appeared: list[tuple[float, np.ndarray, np.ndarray]] = []
        """(time [s], least and largest x, y, z [m]) of each element that has appeared."""

    def append(self, state: RobotState, foot_positions: np.ndarray, reference, **more):
        """Adds one sample.

        Args:
            state: the true state.
            foot_positions: centres of the feet in W [m], (4, 3).
            reference: the active WholeBodyReference, or None.
            more: further arrays or numbers, the same ones at every sample.
        """
        row = {
            "time": state.stamp,
            "p_WB": state.p_WB,
            "rpy_WB": state.rpy_WB,
            "v_WB": state.v_WB,
            "w_WB": state.w_WB,
            "joint_positions": state.joint_positions,
            "joint_velocities": state.joint_velocities,
            "joint_torques": state.joint_torques,
            "contact_forces": state.contact_forces,
            "contacts": state.contacts,
            "foot_positions": foot_positions,
            "reference_p_WB": _reference_position(reference, state.stamp),
            **more,
        }
        blocks, rows = self._samples
        # At once: an interruption leaves whole samples.
        rows.append({key: np.array(value) for key, value in row.items()})
        if self._keep is not None:
            del rows[: -self._keep]
        elif len(rows) == _BLOCK:  # rows of small arrays need four times the memory
            self._samples = [*blocks, _stacked(rows)], []
        kept = self.keep_references and reference is not None and len(reference.times) and not reference.rolling
        if kept and (not self.references or self.references[-1] is not reference):
            self.references.append(reference)

    def note(self, time: float, who: str, what: str) -> None:
        """Takes down what a system says at ``time`` [s]."""
        self.notes.append((float(time), who, what))
        if len(self.notes) > MAX_NOTES:
            del self.notes[_FIRST_NOTES]

    def last(self, name: str) -> np.ndarray | None:
        """An array of the newest sample; None before the first."""
        blocks, rows = self._samples
        return rows[-1][name] if rows else blocks[-1][name][-1] if blocks else None

    def __len__(self) -> int:
        blocks, rows = self._samples
        return _BLOCK * len(blocks) + len(rows)

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns all samples, stacked, the footholds of all references, the notes and what has appeared."""
        blocks, rows = self._samples
        blocks = [*blocks, _stacked(rows)] if rows else blocks
        arrays = {name: np.concatenate([block[name] for block in blocks]) for name in (blocks[0] if blocks else ())}
        footholds = [(f, i) for i, reference in enumerate(self.references) for f in reference.footholds]
        arrays["foothold_leg"] = np.array([int(f.leg) for f, _ in footholds], dtype=int)
        arrays["foothold_position"] = np.array([f.position for f, _ in footholds]).reshape(-1, 3)
        arrays["foothold_touchdown"] = np.array([f.touchdown_time for f, _ in footholds], dtype=float)
        published = [self.references[i].stamp for _, i in footholds]
        arrays["foothold_published"] = np.array(published, dtype=float)
        arrays["foothold_plan"] = np.array([i for _, i in footholds], dtype=int)
        arrays["note_time"] = np.array([time for time, _, _ in self.notes], dtype=float)
        arrays["note_source"] = np.array([who for _, who, _ in self.notes], dtype=str)
        arrays["note_text"] = np.array([what for _, _, what in self.notes], dtype=str)
        arrays["appeared_time"] = np.array([time for time, _, _ in self.appeared], dtype=float)
        arrays["appeared_low"] = np.array([low for _, low, _ in self.appeared], dtype=float).reshape(-1, 3)
        arrays["appeared_high"] = np.array([high for _, _, high in self.appeared], dtype=float).reshape(-1, 3)
        return arrays

    def save(self, path: Path):
        """Writes all arrays to a compressed .npz file, at once."""
        with replacing(path) as unfinished, unfinished.open("wb") as file:
            np.savez_compressed(file, **self.arrays())


def _stacked(rows: list[dict]) -> dict[str, np.ndarray]:
    """Arrays with one row for each of ``rows``."""
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _reference_position(reference, time: float) -> np.ndarray:
    """Base position of the reference at ``time`` [m], (3,); NaN without a reference."""
    if reference is None or len(reference.times) == 0:
        return np.full(3, np.nan)
    positions = reference.states[:, CentroidalState.POSITION]
    return np.array([np.interp(time, reference.times, column) for column in positions.T])
