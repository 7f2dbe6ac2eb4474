"""Repeated trials in one process."""

import ctypes
import gc
import os
import weakref
from pathlib import Path

import pytest

from quadpips_drake.trials.trial import Trial, TrialConfig
from quadpips_drake.trials.walk_trial import WalkTrial, WalkTrialConfig

TRIALS, SETTLED = 10, 3
"""The first ones load libraries and compiled kernels."""
MAX_GROWTH = 20e6
"""[bytes]; a diagram that stays takes 24 to 56 MB."""


def memory_in_use() -> int:
    """Resident memory, without what nobody refers to any more and what malloc keeps for later [bytes]."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="needs Linux and glibc")
@pytest.mark.parametrize(
    ("kind", "config"),
    [(Trial, TrialConfig(terrain="stepping_stones", duration=0.05)), (WalkTrial, WalkTrialConfig(duration=0.05))],
)
def test_repeated_trials_do_not_grow(kind, config):
    sizes = []
    for _ in range(TRIALS):
        trial = kind(config)
        assert trial.run().reason in ("timeout", "upright")
        trial.result()
        sizes.append(memory_in_use())
    assert max(sizes) - max(sizes[:SETTLED]) < MAX_GROWTH, [round(size / 1e6) for size in sizes]


def test_a_trial_goes_when_the_next_one_begins():
    """Without a word to the garbage collector, which would wait for many more objects."""
    gc.disable()
    try:
        diagrams = []
        for _ in range(3):
            trial = WalkTrial(WalkTrialConfig(duration=0.01))
            trial.run()
            diagrams.append(weakref.ref(trial.diagram))
        assert [diagram() is None for diagram in diagrams] == [True, False, False]
    finally:
        gc.enable()
