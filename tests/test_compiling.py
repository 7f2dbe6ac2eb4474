"""The clock that stands still while kernels are compiled; damaged files in their cache."""

import os
import pickle
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
from numba import njit

from quadpips_drake import compiling
from quadpips_drake.timing import StageTimings

KERNEL = """
from numba import njit

@njit(cache=True)
def twice(x):
    return 2 * x
"""


def kernel_of(folder):
    """A kernel in a module of its own, with its cache in ``folder``."""
    import importlib.util

    path = folder / "some_kernels.py"
    path.write_text(KERNEL)
    spec = importlib.util.spec_from_file_location("some_kernels", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.twice


def test_compiling_is_told_and_takes_no_time():
    @njit
    def fresh(x):
        return x + 1

    timings, told = StageTimings(), []
    started, work_started = time.perf_counter(), compiling.work_clock()
    with compiling.on_compiling(lambda: told.append("compiling")), timings.measure("stage"):
        assert fresh(1) == 2
        assert fresh(2) == 3
    elapsed, worked = time.perf_counter() - started, compiling.work_clock() - work_started
    assert told == ["compiling"], "once, and only when it does"
    assert worked < 0.5 * elapsed
    assert timings.summary_ms()["stage"]["total"] <= 1e3 * worked + 0.1
    with compiling.on_compiling(lambda: told.append("again")):
        fresh(3)
    assert told == ["compiling"]


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("keep", [0, 0.5, -1])
def test_a_damaged_kernel_is_compiled_anew(suffix, keep, tmp_path, monkeypatch):
    assert kernel_of(tmp_path)(2) == 4
    (damaged,) = tmp_path.rglob(f"*{suffix}")
    whole = damaged.read_bytes()
    again = kernel_of(tmp_path)
    folder = SimpleNamespace(stats=SimpleNamespace(cache_path=str(damaged.parent)))
    monkeypatch.setattr(compiling, "_kernels", lambda: [folder])
    assert compiling.remove_broken_kernels() == []
    damaged.write_bytes(whole[: int(keep * len(whole)) if keep >= 0 else keep])
    with pytest.raises((EOFError, pickle.UnpicklingError)):
        kernel_of(tmp_path)(2)
    assert compiling.remove_broken_kernels() == [damaged]
    assert again(2) == 4


COMPILING = """
import sys, time
sys.path.insert(0, sys.argv[1])
from numba.core import caching
import quadpips_drake.compiling
import some_kernels

def slowly(self, overloads, save_index=caching.IndexDataCacheFile._save_index):
    time.sleep(1.0)  # the other process is there by now
    save_index(self, overloads)

caching.IndexDataCacheFile._save_index = slowly
print("ready", flush=True)
input()
print(*(some_kernels.twice(eval(argument)) for argument in sys.argv[2:]))
print(sum(some_kernels.twice.stats.cache_hits.values()), "found")
"""


def test_processes_that_compile_one_kernel_at_the_same_time_lose_nothing(tmp_path):
    kernel_of(tmp_path)

    def start(*arguments):
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        process = subprocess.Popen([sys.executable, "-c", COMPILING, str(tmp_path), *arguments], **pipes)
        assert process.stdout.readline() == "ready\n"
        return process

    processes = start("1"), start("1.5")
    for process in processes:
        process.stdin.write("\n")
        process.stdin.flush()
    assert [process.communicate(timeout=60)[0] for process in processes] == ["2\n0 found\n", "3.0\n0 found\n"]
    assert start("1", "1.5").communicate("\n", timeout=60)[0] == "2 3.0\n2 found\n"


FEET = """
import numpy as np
from quadpips_drake import compiling
from quadpips_drake.robots.robot_library import load_robot

robot, random = load_robot("anymal_c"), np.random.default_rng(1)
p_WB, rpy = random.normal(0.0, 0.05, (50, 3)), random.normal(0.0, 0.2, (50, 3))
feet = robot.nominal_footholds_B + random.normal(0.0, 0.05, (50, 4, 3))
joints, reached = robot.joints_following(p_WB, rpy, feet, robot.nominal_joints)
print((joints.sum(axis=1) @ np.sin(np.arange(50.0))).hex(), joints[17, 5].hex(), reached.sum())
print(any(sum(kernel.stats.cache_hits.values()) for kernel in compiling._kernels()))
"""


def test_code_that_was_compiled_before_computes_the_same_bits(tmp_path):
    def run():
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
        return subprocess.run(
            [sys.executable, "-c", FEET], env=environment, capture_output=True, text=True, check=True
        ).stdout

    (cold, cold_hits), (warm, warm_hits) = run().splitlines(), run().splitlines()
    assert (cold_hits, warm_hits) == ("False", "True")
    assert cold == warm


def test_warmth_is_remembered_until_sources_change(tmp_path, monkeypatch):
    monkeypatch.setattr(compiling, "_anchor", SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path))))
    assert not compiling.are_warm("some stages")
    compiling.note_warm("some stages")
    assert compiling.are_warm("some stages")
    assert not compiling.are_warm("other stages")
    compiler = compiling._compiler()
    monkeypatch.setattr(compiling, "_compiler", lambda: compiler | {"newest_source": compiler["newest_source"] + 1.0})
    assert not compiling.are_warm("some stages")


def test_kernels_go_when_what_they_were_compiled_from_has_changed(tmp_path, monkeypatch):
    sources = {
        "caller": "from numba import njit\nfrom quadpips_drake.sub.callee import twice\n",
        "sub/callee": "from numba import njit\nfrom quadpips_drake.sub.numbers import TWO\n",
        "sub/numbers": "from quadpips_drake.other import more\nTWO = 2\n",
        "other": "from numba import njit\n",
    }
    for name, text in sources.items():
        path = tmp_path / f"{name}.py"
        (path.parent / "__pycache__").mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        os.utime(path, (100.0, 100.0))
    kernels = {name: tmp_path / f"{name}.py" for name in ("caller", "sub/callee", "other")}
    kernels = {name: path.parent / "__pycache__" / f"{path.stem}.some-1.py311.nbi" for name, path in kernels.items()}
    monkeypatch.setattr(compiling, "__file__", str(tmp_path / "compiling.py"))
    monkeypatch.setattr(
        compiling, "_anchor", SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path / "__pycache__")))
    )
    gone = {}
    for changed in ("nothing", *sources):
        for path in kernels.values():
            path.touch()
            os.utime(path, (200.0, 200.0))
        if changed != "nothing":
            os.utime(tmp_path / f"{changed}.py", (300.0, 300.0))
        removed = compiling.remove_stale_kernels()
        gone[changed] = {name for name, path in kernels.items() if path in removed and not path.exists()}
        if changed != "nothing":
            os.utime(tmp_path / f"{changed}.py", (100.0, 100.0))
    both = {"caller", "sub/callee"}
    assert gone == {"nothing": set(), "caller": {"caller"}, "sub/callee": both, "sub/numbers": both, "other": {"other"}}


def test_kernels_of_the_package_are_found():
    import quadpips_drake.math.polygons  # noqa: F401

    names = {kernel.py_func.__name__ for kernel in compiling._kernels()}
    assert "convex_hull" in names
