"""Where the time of a simulation goes: an established profiler around it, and who owns what it finds.

pyinstrument looks at the Python stack every few milliseconds; what a function of Drake's needs by itself shows as a frame
of its own there. Function calls are counted exactly, by cProfile, in short windows that take turns with it.
"""

import cProfile
import pstats
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from pyinstrument import Profiler
from pyinstrument.frame import Frame
from pyinstrument.renderers import HTMLRenderer
from pyinstrument.stack_sampler import build_call_stack

INTERVAL = 0.002
"""Between two looks at the stack, wall-clock time [s]."""
COUNTING_PERIOD, MAX_COUNTING_WINDOWS = 1.0, 30
"""Calls are counted for one of the progress's steps (0.1 s) in each such stretch of simulated time [s], so often at most."""
_IMAGE_READERS = ("depth_noise_system", "self_filter_system", "normal_estimator_system", "steppability_segmenter_system")
"""Systems that have the renderer make an image by reading it."""

_DRAKE_CALLS = ("AdvanceTo", "Initialize", "Eval", "HasValue")
LOG, PORTS, RENDERING = "log and judge", "values from port to port", "rendering of depth images"
DRAKE, OTHER = "Drake", "anything else"
"""Who may own time; besides these every system, by its name."""


class _Sampler(Profiler):
    """pyinstrument's, which also knows who called a compiled kernel: the frames that numba shows do not say it."""

    def _sampler_saw_call_stack(self, call_stack, time_since_last_sample, async_state):
        if len(call_stack) <= 2:  # thread, kernel
            call_stack = build_call_stack(sys._getframe(2), "", None) + call_stack[1:]
        super()._sampler_saw_call_stack(call_stack, time_since_last_sample, async_state)


@dataclass
class CallCounts:
    """Function calls in the windows in which they were counted."""

    sim_time: float = 0.0
    """Simulated in these windows [s]."""
    profile: cProfile.Profile = field(default_factory=cProfile.Profile)

    def per_second(self) -> dict[str, float]:
        """Calls per simulated second: of Python functions, of compiled ones, and of those that read and write ports."""
        if self.sim_time <= 0.0:
            return {}
        calls = {"python": 0, "compiled": 0, "port_reads": 0, "port_writes": 0}
        for (file, _, name), (_, count, *_) in pstats.Stats(self.profile).stats.items():
            calls["compiled" if file == "~" else "python"] += count
            if file == "~" and name.endswith((".Eval>", ".HasValue>")):
                calls["port_reads"] += count
            if file.endswith("framework/ports.py") and name == "write":
                calls["port_writes"] += count
        return {kind: count / self.sim_time for kind, count in calls.items()}

    def most_called(self, number: int) -> list[tuple[str, float]]:
        """The ``number`` functions that are called most often, with their calls per simulated second."""
        if self.sim_time <= 0.0:
            return []
        counts = {key: entry[1] for key, entry in pstats.Stats(self.profile).stats.items()}
        found = sorted(counts, key=counts.get, reverse=True)[:number]
        return [(_function_name(*key), counts[key] / self.sim_time) for key in found]


class SimulationProfiler:
    """Profiles what happens inside ``with``; has to be told the simulated time now and then (``tick``)."""

    def __init__(self):
        self._sampler = _Sampler(interval=INTERVAL, async_mode="disabled")
        self.counts = CallCounts()
        self._windows = 0
        self._counting_since: float | None = None
        self._time = 0.0

    def __enter__(self):
        self._sampler.start()
        return self

    def __exit__(self, *_):
        if self._counting_since is None:
            self._sampler.stop()
        else:
            self._stop_counting()

    def watching(self, progress: Callable[[float], None] | None) -> Callable[[float], None]:
        """A callback for ``SimulatedTrial.run`` that tells this profiler the time, and ``progress`` too."""

        def both(time: float) -> None:
            if progress is not None:
                progress(time)
            self.tick(time)

        return both

    def tick(self, time: float) -> None:
        """Takes the simulated time [s]; decides who profiles from here on."""
        self._time = time
        if self._counting_since is not None:
            self._stop_counting()
            self._sampler.start()
        elif self._windows < MAX_COUNTING_WINDOWS and time >= (self._windows + 0.1) * COUNTING_PERIOD:
            self._windows += 1
            self._sampler.stop()
            self._counting_since = time
            self.counts.profile.enable()

    def _stop_counting(self) -> None:
        self.counts.profile.disable()
        self.counts.sim_time += self._time - self._counting_since
        self._counting_since = None

    def session_html(self) -> str:
        """pyinstrument's page of what it has found."""
        return HTMLRenderer().render(self._sampler.last_session)

    @property
    def sampled_sim_time(self) -> float:
        """Simulated while the stack was looked at [s]."""
        return self._time - self.counts.sim_time

    def seconds_by_owner(self) -> dict[str, float]:
        """Wall-clock time [s] by owner: a partition of all that was sampled."""
        seconds: dict[str, float] = {}
        root = self._sampler.last_session.root_frame(trim_stem=False)
        if root is not None:
            _add_own_time(root, (), seconds)
        return seconds


def _add_own_time(frame: Frame, above: tuple[Frame, ...], seconds: dict[str, float]) -> None:
    """Files the time that ``frame`` spends itself, and that of all below it, under its owner."""
    path = (*above, frame)
    owner = _owner(path)
    below = sum(child.time for child in frame.children if not child.is_synthetic)
    seconds[owner] = seconds.get(owner, 0.0) + frame.time - below
    for child in frame.children:
        if not child.is_synthetic:
            _add_own_time(child, path, seconds)


def _owner(path: tuple[Frame, ...]) -> str:
    """Whose time it is that the last frame of ``path`` spends itself."""
    # Drake's own work: the simulation loop (no frame of its own when it comes back to Python in between), reading ports.
    last = path[-1]
    in_loop = last.function == "run" and Path(last.file_path or "").parent.name == "trials"
    in_drake = in_loop or last.function.removeprefix("PyCapsule.") in _DRAKE_CALLS
    for frame in reversed(path):
        file = Path(frame.file_path or "")
        if file.stem.endswith("_system"):
            if in_drake:
                return RENDERING if file.stem in _IMAGE_READERS else DRAKE
            return file.stem.removesuffix("_system").replace("_", " ")
        if file.parent.name == "framework" and not in_drake:
            return PORTS
        if frame.function == "sample" and file.parent.name == "trials":
            return DRAKE if in_drake else LOG
    return DRAKE if in_drake else OTHER


def _function_name(file: str, line: int, name: str) -> str:
    return name if file == "~" else f"{name} ({'/'.join(Path(file).parts[-2:])}:{line})"
