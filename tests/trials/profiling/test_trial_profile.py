"""The profile of a trial: its files, and that its shares add up."""

import json
import re

import numpy as np
import pytest

from quadpips_drake.interruption import interruptible
from quadpips_drake.trials import record
from quadpips_drake.trials.profiling import trial_profile
from quadpips_drake.trials.record import record_trial
from quadpips_drake.trials.walk_trial import WalkTrialConfig, run_walk
from tests.trials.toy_trial import ToyConfig, ToyTrial


def test_a_profiled_walk_says_where_its_time_went(tmp_path):
    result = run_walk(WalkTrialConfig(duration=1.5), tmp_path, recording=False, profile=True)
    found = json.loads((tmp_path / "profile.json").read_text())
    parts = {part["name"]: part for part in found["parts"]}
    assert sum(part["share"] for part in parts.values()) == pytest.approx(1.0)
    assert all(0.0 <= part["share"] < 1.0 for part in parts.values())
    loads = [part["load"] for part in parts.values()]
    assert loads == sorted(loads, reverse=True)
    for name in ("physics", "Drake's framework", "whole body controller", "centroidal mpc", "log and judge"):
        assert parts[name]["load"] > 0.0, name
    # The stages' own stopwatch measures the same in another way.
    for name, stage in (("whole body controller", "whole_body_control"), ("centroidal mpc", "centroidal_mpc")):
        clocked = found["stages"][stage]["total"] / 1e3 / result.sim_time
        assert clocked / 2.5 < parts[name]["load"] < 2.5 * clocked
    assert sum(loads) == pytest.approx(1.0 / result.realtime_factor, rel=0.5)
    assert found["calls"]["python"] > 1000.0 and found["calls"]["port_reads"] > 1000.0
    assert found["most_called"][0][1] >= found["most_called"][-1][1]
    assert {part["how"] for part in parts.values()} <= found["how"].keys()
    page = (tmp_path / "profile.html").read_text()
    assert "whole body controller" in page
    assert set(re.findall(r"https?://[\w.]+", page)) <= {"http://www.w3.org"}, "the page needs no network"


def test_profiling_changes_no_bit(tmp_path):
    for name, profile in (("without", False), ("with", True)):
        run_walk(WalkTrialConfig(duration=0.7), tmp_path / name, recording=False, profile=profile)
    plain, profiled = (np.load(tmp_path / name / "log.npz") for name in ("without", "with"))
    assert plain.files == profiled.files
    for array in plain.files:
        assert plain[array].tobytes() == profiled[array].tobytes(), array


def test_an_interrupted_trial_has_a_profile_too(tmp_path, monkeypatch):
    monkeypatch.setattr(record, "remove_broken_kernels", list)
    monkeypatch.setattr(trial_profile, "physics_load", lambda station, arrays: 0.0)
    with pytest.raises(KeyboardInterrupt), interruptible():
        config = ToyConfig(duration=0.1, fails="SIGINT")
        record_trial(ToyTrial, config, tmp_path, recording=False, profile=True, warm_up=lambda: None)
    assert {"profile.html", "profile.json", "result.json"} <= {path.name for path in tmp_path.iterdir()}
