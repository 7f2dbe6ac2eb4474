"""How long each stage computes, in wall-clock time.

A measuring instrument beside the diagram: it never influences a result, so it is the one thing that a calc may write to.
The compiling of kernels, which happens once in a machine's life, is no part of it.
"""

from collections import defaultdict, deque
from contextlib import contextmanager

import numpy as np

from quadpips_drake.compiling import work_clock


class StageTimings:
    """Collects wall-clock durations per stage name."""

    def __init__(self, keep: int | None = None):
        """``keep``: how many of each stage are kept, the newest ones; None: all."""
        self._samples = defaultdict(lambda: deque(maxlen=keep))

    @contextmanager
    def measure(self, stage: str):
        """Times the enclosed block and files it under ``stage``."""
        start = work_clock()
        try:
            yield
        finally:
            self._samples[stage].append(work_clock() - start)

    def record(self, stage: str, seconds: float):
        """Files one duration [s] that was measured elsewhere (a solver's own clock, say)."""
        self._samples[stage].append(seconds)

    def samples(self) -> dict[str, list[float]]:
        """All durations [s] so far, by stage."""
        return {stage: list(samples) for stage, samples in self._samples.items()}

    def summary_ms(self) -> dict:
        """Returns ``{stage: {"n", "p50", "p95", "max", "total"}}`` in milliseconds."""
        summary = {}
        for stage, samples in sorted(self._samples.items()):
            ms = 1e3 * np.asarray(samples)
            summary[stage] = {
                "n": len(ms),
                "p50": round(float(np.percentile(ms, 50)), 3),
                "p95": round(float(np.percentile(ms, 95)), 3),
                "max": round(float(ms.max()), 3),
                "total": round(float(ms.sum()), 1),
            }
        return summary
