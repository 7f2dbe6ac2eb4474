"""result.json, log.npz and the foothold statistics."""

import json

import numpy as np
import pytest

from quadpips_drake.trials import trial_log
from quadpips_drake.trials.result import TrialResult, installed_versions
from quadpips_drake.trials.steps.foothold_statistics import foothold_statistics
from quadpips_drake.trials.trial_log import MAX_NOTES, TrialLog
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from tests.trials.test_judge import state


def reference_with_one_step(target=(0.3, 0.2, 0.03)):
    stance = np.ones((3, 4), bool)
    stance[1, Leg.LF] = False
    schedule = ContactSchedule(np.array([0.1, 0.5]), stance)
    foothold = FootholdTarget(Leg.LF, 0.1, 0.5, np.array(target), np.array([0.0, 0.0, 1.0]))
    return WholeBodyReference(0.0, 1, np.array([0.0, 1.0]), np.zeros((2, 24)), np.zeros((2, 24)), schedule, (foothold,))


def track(landing, drift=0.0, touches=True):
    """Foot positions and contacts of a foot that lands at ``landing`` at 0.5 s and drifts from there."""
    time = np.arange(0, 1.2, 0.01)
    positions = np.zeros((len(time), 4, 3))
    positions[time >= 0.5, Leg.LF, :2] = landing
    positions[:, Leg.LF, 0] += np.where(time > 0.6, drift * (time - 0.6), 0)
    return time, positions, np.full((len(time), 4), touches)


@pytest.mark.parametrize(
    ("landing", "drift", "touches", "slipped", "missed"),
    [
        ((0.3, 0.2), 0.0, True, 0, 0),
        ((0.36, 0.2), 0.0, True, 0, 1),
        ((0.3, 0.2), 0.0, False, 0, 1),
        ((0.3, 0.2), 0.1, True, 1, 0),
    ],
)
def test_statistics_count_misses_and_slips(landing, drift, touches, slipped, missed):
    counts = foothold_statistics([reference_with_one_step()], *track(landing, drift, touches))
    assert (counts["planned"], counts["slipped"], counts["missed"]) == (1, slipped, missed)
    assert counts["landing_error_max"] == pytest.approx(np.linalg.norm(np.array(landing) - [0.3, 0.2]), abs=1e-9)


def test_a_cancelled_foothold_does_not_count():
    first, second = reference_with_one_step(), reference_with_one_step()
    object.__setattr__(second, "stamp", 0.3)
    counts = foothold_statistics([first, second], *track((0.3, 0.2)))
    assert counts["planned"] == 1


def test_result_survives_a_round_trip_and_has_no_nan(tmp_path):
    result = TrialResult(False, "fell", "go2", "flat", "quadpips", 3, versions=installed_versions())
    result.save(tmp_path / "result.json")
    document = json.loads((tmp_path / "result.json").read_text())
    assert document["reason"] == "fell"
    assert document["distance_to_goal"] is None
    assert document["versions"]["drake"] != "unknown"


def test_an_unknown_reason_is_refused():
    with pytest.raises(ValueError, match="reason"):
        TrialResult(False, "tired", "go2", "flat", "quadpips", 3)


def test_log_stacks_samples_and_keeps_each_reference_once(tmp_path):
    log, reference = TrialLog(), reference_with_one_step()
    for t in (0.0, 0.5):
        log.append(state(t), np.zeros((4, 3)), reference, phase=2)
    log.save(tmp_path / "log.npz")
    with np.load(tmp_path / "log.npz") as arrays:
        assert arrays["time"].tolist() == [0.0, 0.5]
        assert arrays["foot_positions"].shape == (2, 4, 3)
        assert arrays["foothold_leg"].tolist() == [int(Leg.LF)]
        assert arrays["phase"].tolist() == [2, 2]


def test_a_long_log_is_kept_in_blocks(monkeypatch):
    monkeypatch.setattr(trial_log, "_BLOCK", 4)
    log = TrialLog()
    for k in range(10):
        assert len(log) == k
        log.append(state(0.1 * k), np.full((4, 3), k), None, phase=k, unstable=np.int8(1))
    arrays = log.arrays()
    assert arrays["phase"].tolist() == list(range(10)) and arrays["unstable"].dtype == np.int8
    assert arrays["foot_positions"].shape == (10, 4, 3) and len(arrays["time"]) == 10


def test_notes_and_what_appeared_have_rows_of_their_own():
    log = TrialLog()
    for k in range(2 * MAX_NOTES):
        log.note(k, "planner", f"note {k}")
    log.appeared.append((1.0, np.zeros(3), np.ones(3)))
    arrays = log.arrays()
    assert len(arrays["note_time"]) == MAX_NOTES
    assert arrays["note_text"][0] == "note 0" and arrays["note_text"][-1] == f"note {2 * MAX_NOTES - 1}"
    assert arrays["appeared_high"].tolist() == [[1.0, 1.0, 1.0]]
