"""Settings of the whole test suite."""

import os
import signal

# Two test processes with a BLAS thread for each core would fight over the cores; the matrices here are small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Plots are drawn into files.
os.environ.setdefault("MPLBACKEND", "Agg")
# A shell that starts the suite in the background has it ignore Ctrl-C, which some tests send themselves.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items):
    """Starts the files that hold slow tests first: with several processes the suite then ends together."""
    slow_files = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow_files)
