"""Compiling ahead: it leaves nothing to compile for a trial, it happens once, and a failure is no obstacle."""

import subprocess
import sys
from types import SimpleNamespace

import pytest

from quadpips_drake import compiling
from quadpips_drake.trials.warming import warm_up as warming

TRIALS = """
from quadpips_drake import compiling
from quadpips_drake.trials.trial import Trial, TrialConfig
from quadpips_drake.trials.walk_trial import WalkTrial, WalkTrialConfig
from quadpips_drake.trials.warming.warm_up import EXERCISES

def specialisations():
    return {(k.py_func.__module__, k.py_func.__name__, str(s)) for k in compiling._kernels() for s in k.signatures}

for exercise in EXERCISES.values():
    exercise()
before = specialisations()
Trial(TrialConfig(duration=3.0)).run()
WalkTrial(WalkTrialConfig(robot="go2", terrain="ramp_10", duration=1.0)).run()
print(len(before), "and", *sorted(specialisations() - before), sep="\\n")
"""


@pytest.mark.slow
def test_a_trial_finds_all_of_its_kernels_compiled():
    done = subprocess.run([sys.executable, "-c", TRIALS], capture_output=True, text=True, check=True)
    number, _, missing = done.stdout.partition("and\n")
    assert int(number) > 40
    assert missing.strip() == "", "not among what the exercises compile; call it there as a trial does"


@pytest.fixture
def cold(tmp_path, monkeypatch):
    """Nothing is compiled yet, and what is to be compiled are the exercises in this dictionary."""
    exercises = {}
    monkeypatch.setattr(compiling, "_anchor", SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path))))
    monkeypatch.setattr(warming, "EXERCISES", exercises)
    return exercises


def test_it_happens_once(cold):
    calls, told = [], []
    cold |= {"legs": lambda: calls.append("legs"), "eyes": lambda: calls.append("eyes")}
    assert warming.cold_groups() == ["legs", "eyes"]
    assert warming.warm_up(lambda *state: told.append(state)) == {}
    assert calls == ["legs", "eyes"] and warming.cold_groups() == []
    assert told == [(["legs"], 0, 2), (["eyes"], 1, 2), ([], 2, 2)]
    warming.warm_up()
    assert calls == ["legs", "eyes"]


def test_what_cannot_be_compiled_ahead_is_left_for_later(cold, monkeypatch):
    def breaks():
        raise RuntimeError("no ground")

    cold |= {"ground": breaks, "eyes": lambda: None}
    failures = warming.warm_up()
    assert [str(error) for error in failures.values()] == ["no ground"]
    assert warming.cold_groups() == ["ground"]


def test_damaged_code_is_compiled_anew(cold, monkeypatch):
    removed = []

    def needs_code():
        if not removed:
            raise EOFError

    monkeypatch.setattr(warming, "remove_broken_kernels", lambda: removed.append("kernel") or removed)
    cold["eyes"] = needs_code
    assert warming.warm_up() == {} and removed == ["kernel"]


def test_processes_do_it_and_fail_alone(monkeypatch):
    """The processes know the real exercises only."""
    monkeypatch.setattr(warming, "cold_groups", lambda: ["robot and ground", "no such group"])
    told = []
    failures = warming.warm_up(lambda *state: told.append(state), workers=2)
    assert list(failures) == ["no such group"] and isinstance(failures["no such group"], KeyError)
    assert told[0] == (["robot and ground", "no such group"], 0, 2) and told[-1] == ([], 2, 2)
    assert compiling.are_warm("robot and ground")
