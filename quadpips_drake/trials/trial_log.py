"""log.npz: what happened, sampled at a fixed rate; holds simulated quantities only, so the same seed gives the same bits."""

from pathlib import Path

import numpy as np

from quadpips_drake.files import replacing
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.robot_state import RobotState


class TrialLog:
    """Grows by one row per sample; every array has the sample as its first axis."""

    def __init__(self):
        self.keep_references = True
        """Whether to collect references as they are published; rolling ones supersede each other too fast for that."""
        self._rows: list[dict[str, np.ndarray]] = []
        self.references: list = []
        """Each published WholeBodyReference once, in order."""

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
        # At once: an interruption leaves whole samples.
        self._rows.append({key: np.array(value) for key, value in row.items()})
        is_new = (
            self.keep_references and reference is not None and (not self.references or self.references[-1] is not reference)
        )
        if is_new and len(reference.times):
            self.references.append(reference)

    def last(self, name: str) -> np.ndarray | None:
        """An array of the newest sample; None before the first."""
        return self._rows[-1][name] if self._rows else None

    def __len__(self) -> int:
        return len(self._rows)

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns all samples, stacked, and the footholds of all references."""
        names = self._rows[0] if self._rows else ()
        arrays = {name: np.array([row[name] for row in self._rows]) for name in names}
        footholds = [(f, i) for i, reference in enumerate(self.references) for f in reference.footholds]
        arrays["foothold_leg"] = np.array([int(f.leg) for f, _ in footholds], dtype=int)
        arrays["foothold_position"] = np.array([f.position for f, _ in footholds]).reshape(-1, 3)
        arrays["foothold_touchdown"] = np.array([f.touchdown_time for f, _ in footholds], dtype=float)
        published = [self.references[i].stamp for _, i in footholds]
        arrays["foothold_published"] = np.array(published, dtype=float)
        arrays["foothold_plan"] = np.array([i for _, i in footholds], dtype=int)
        return arrays

    def save(self, path: Path):
        """Writes all arrays to a compressed .npz file, at once."""
        with replacing(path) as unfinished, unfinished.open("wb") as file:
            np.savez_compressed(file, **self.arrays())


def _reference_position(reference, time: float) -> np.ndarray:
    """Base position of the reference at ``time`` [m], (3,); NaN without a reference."""
    if reference is None or len(reference.times) == 0:
        return np.full(3, np.nan)
    positions = reference.states[:, CentroidalState.POSITION]
    return np.array([np.interp(time, reference.times, column) for column in positions.T])
