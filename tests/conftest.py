"""Settings of the whole test suite."""

import os

# Two test processes with a BLAS thread for each core would fight over the cores; the matrices here are small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Plots are drawn into files.
os.environ.setdefault("MPLBACKEND", "Agg")


def pytest_collection_modifyitems(items):
    """Starts the files that hold slow tests first: with several processes the suite then ends together."""
    slow_files = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow_files)
