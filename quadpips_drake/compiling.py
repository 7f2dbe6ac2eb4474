"""Compiling of the numba kernels: how long it takes, whether it has been done before, and results of it that are damaged.

Kernels are compiled when they are first called, for a minute or two in all, and kept in a cache on disk. What computing
costs must not depend on whether that has happened yet, so durations are taken with a clock that stands still meanwhile.
"""

import json
import pickletools
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import wraps
from pathlib import Path

import llvmlite.binding
import numba
from filelock import FileLock
from numba.core import caching, event
from numba.core.dispatcher import Dispatcher

from quadpips_drake.files import write_json

_PACKAGE = "quadpips_drake."
_PATIENCE = 10.0
"""How long a process waits for others that save compiled kernels [s]."""


class _Stopwatch(event.Listener):
    """Sums the time in which numba compiles; callees are compiled while their callers are."""

    def __init__(self):
        self.total = 0.0
        """[s]"""
        self.listeners: list[Callable[[], None]] = []
        self._depth, self._began = 0, 0.0

    def on_start(self, event):
        if self._depth == 0:
            self._began = time.perf_counter()
            for listener in self.listeners:
                listener()
        self._depth += 1

    def on_end(self, event):
        self._depth -= 1
        if self._depth == 0:
            self.total += time.perf_counter() - self._began


_stopwatch = _Stopwatch()
event.register("numba:compile", _stopwatch)


def _one_at_a_time(save: Callable) -> Callable:
    """``save`` of numba's cache, by one process at a time.

    It reads the index of a kernel, adds a specialisation, and writes it back: of two processes that do so at once one would
    lose its entry, and both could take the same file for their code.
    """

    @wraps(save)
    def saved(cache, *arguments):
        folder = Path(cache.cache_path)
        lock = FileLock(folder / "saving.lock")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock.acquire(timeout=_PATIENCE)
        except (OSError, NotImplementedError):  # a file system without locks, or a process that hangs
            return save(cache, *arguments)
        try:
            return save(cache, *arguments)
        finally:
            lock.release()

    return saved


caching.Cache.save_overload = _one_at_a_time(caching.Cache.save_overload)


def work_clock() -> float:
    """Wall-clock time [s] from an arbitrary origin, without the time in which kernels were compiled."""
    return time.perf_counter() - _stopwatch.total


@contextmanager
def on_compiling(listener: Callable[[], None]) -> Iterator[None]:
    """Calls ``listener`` in the block whenever a kernel is about to be compiled."""
    _stopwatch.listeners.append(listener)
    try:
        yield
    finally:
        _stopwatch.listeners.remove(listener)


def are_warm(group: str) -> bool:
    """Whether the kernels of a group have been compiled since the source of any kernel changed last."""
    try:
        return json.loads(_stamp(group).read_text(encoding="utf-8")) == _compiler()
    except (OSError, ValueError):
        return False


def note_warm(group: str) -> None:
    """Notes that the kernels of a group have been compiled, where that can be written."""
    with suppress(OSError):
        write_json(_stamp(group), _compiler())


def remove_broken_kernels() -> list[Path]:
    """Removes damaged files (cut short, say, when a disk was full) from the cache, and returns their paths.

    Numba itself would fail when it loads them; what is missing it compiles anew.
    """
    folders = {Path(kernel.stats.cache_path) for kernel in _kernels()}
    broken = [path for folder in folders for path in folder.glob("*.nb[ic]") if not _is_whole(path)]
    for path in broken:
        path.unlink(missing_ok=True)
    return broken


def remove_stale_kernels() -> list[Path]:
    """Removes kernels from the cache that call, or read a constant of, a module that has changed since; returns their paths.

    Numba looks only at the file in which a kernel itself stands. What it calls has been compiled into it.
    """
    package = Path(__file__).parent
    if Path(_anchor.stats.cache_path).parent != package:  # the sources cannot be written, so nobody changes them
        return []
    stale = []
    for index in package.rglob("__pycache__/*.nbi"):
        source = index.parent.parent / f"{index.name.split('.')[0]}.py"
        if source.is_file() and index.stat().st_mtime < max(path.stat().st_mtime for path in _compiled_into(source)):
            stale.append(index)
    for path in stale:
        path.unlink(missing_ok=True)
    return stale


def _compiled_into(source: Path, found: set[Path] | None = None) -> set[Path]:
    """The files that kernels in the file ``source`` consist of: itself, and what it imports of the package."""
    found = set() if found is None else found
    found.add(source)
    text = source.read_text(encoding="utf-8")
    if "njit" not in text:  # constants, which a kernel holds as well
        return found
    for module in re.findall(rf"^from ({re.escape(_PACKAGE)}[\w.]+) import", text, re.MULTILINE):
        path = Path(__file__).parent.joinpath(*module.split(".")[1:]).with_suffix(".py")
        if path.is_file() and path not in found:
            _compiled_into(path, found)
    return found


def _kernels() -> list[Dispatcher]:
    """All cached kernels of the package's modules that have been imported."""
    modules = [module for name, module in list(sys.modules.items()) if name.startswith(_PACKAGE)]
    found = {id(item): item for module in modules for item in vars(module).values() if isinstance(item, Dispatcher)}
    return [kernel for kernel in found.values() if kernel.stats.cache_path]


def _stamp(group: str) -> Path:
    """The file beside the compiled kernels that says that those of a group are complete."""
    return Path(_anchor.stats.cache_path) / f"warm-{group.replace(' ', '-')}.json"


def _compiler() -> dict:
    """What compiled kernels depend on: numba, the processor, and the newest of their sources."""
    sources = [path for path in Path(__file__).parent.rglob("*.py") if b"njit" in path.read_bytes()]
    newest = max(path.stat().st_mtime for source in sources for path in _compiled_into(source))
    return {"numba": numba.__version__, "processor": llvmlite.binding.get_host_cpu_name(), "newest_source": newest}


@numba.njit(cache=True)
def _anchor():
    """Never called: says where numba keeps its cache for this package."""


def _is_whole(path: Path) -> bool:
    """Whether a file consists of complete pickles and nothing else, which is what numba writes."""
    try:
        with path.open("rb") as file:
            file.seek(0, 2)
            size = file.tell()
            file.seek(0)
            while file.tell() < size or size == 0:
                for _ in pickletools.genops(file):
                    pass
    except FileNotFoundError:  # replaced meanwhile by another process
        return True
    except Exception:  # whatever a damaged pickle makes of the reader
        return False
    return True
