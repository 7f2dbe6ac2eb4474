"""The report of a walk that was really simulated, and made again from its files."""

import json

import numpy as np
import pytest

from quadpips_drake.faults.push_system import Push
from quadpips_drake.trials.reporting.post_mortem import post_mortem_of
from quadpips_drake.trials.reporting.reading import read_record
from quadpips_drake.trials.reporting.report import cause_of
from quadpips_drake.trials.walk_trial import WalkTrialConfig, run_walk
from tests.trials.reporting.test_pages import read


@pytest.mark.slow
def test_a_walk_that_is_pushed_over(tmp_path):
    pushes = [Push(force=[0.0, 900.0, 0.0], time=1.0, duration=0.1)]
    result = run_walk(WalkTrialConfig(duration=4.0, pushes=pushes), tmp_path, recording=False)
    assert (result.reason, result.cause["cause"], result.cause["time"]) == ("fell", "push", 1.0)
    page = read((tmp_path / "report.html").read_text())
    assert "900 N along +y" in page.text
    record = read_record(tmp_path)
    assert record.remarks == ()
    assert cause_of(post_mortem_of(record)) == result.cause == json.loads((tmp_path / "result.json").read_text())["cause"]
    assert np.nanmin(record.log["mpc_age"]) >= 0.0
    assert "safety" in record.log["note_source"]
