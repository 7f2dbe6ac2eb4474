"""How well the feet did what was planned for them."""

import numpy as np

from quadpips_drake.values.reference import SETTLING_TIME


def foothold_statistics(
    references: list,
    time: np.ndarray,
    foot_positions: np.ndarray,
    contacts: np.ndarray,
    *,
    miss_distance=0.05,
    slip_distance=0.03,
) -> dict:
    """Counts planned, missed and slipped footholds.

    A foothold is *missed* when the foot is more than ``miss_distance`` [m] off (horizontally) SETTLING_TIME after its
    planned touch-down or has not touched the ground by then; it is *slipped* when the foot, once down, moves more than
    ``slip_distance`` [m] horizontally before it is lifted again (or its plan ends).

    Args:
        references: the published WholeBodyReferences in order; a newer one cancels the footholds that an older one
            still had, or takes them over.
        time: sample times [s], (n,).
        foot_positions: foot centres in W [m], (n, 4, 3).
        contacts: measured contacts, (n, 4).
    """
    counts = {"planned": 0, "slipped": 0, "missed": 0}
    errors = []
    for i, reference in enumerate(references):
        cancelled = references[i + 1].stamp if i + 1 < len(references) else np.inf
        for foothold in reference.footholds:
            settled = foothold.touchdown_time + SETTLING_TIME
            if settled > min(time[-1], cancelled):
                continue
            counts["planned"] += 1
            at = int(np.searchsorted(time, settled))
            error = np.linalg.norm(foot_positions[at, foothold.leg, :2] - foothold.position[:2])
            errors.append(error)
            if error > miss_distance or not contacts[at, foothold.leg]:
                counts["missed"] += 1
            lifts = [start for start, _ in reference.schedule.swings(foothold.leg) if start > foothold.touchdown_time]
            until = int(np.searchsorted(time, min([*lifts, max(reference.end_time, settled), cancelled])))
            track = foot_positions[at : max(until, at + 1), foothold.leg, :2]
            if np.linalg.norm(track - track[0], axis=1).max() > slip_distance:
                counts["slipped"] += 1
    counts["landing_error_p50"] = round(float(np.median(errors)), 4) if errors else None
    counts["landing_error_max"] = round(float(np.max(errors)), 4) if errors else None
    return counts
