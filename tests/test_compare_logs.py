"""The comparison of logs finds what differs, and nothing where nothing does."""

import numpy as np
import pytest

from tests.compare_logs import differences, main


def _log(samples: int, **changes) -> dict[str, np.ndarray]:
    touchdowns = np.array([0.1, 0.4, 0.9])
    log = {
        "time": 0.1 * np.arange(samples),
        "p_WB": np.full((samples, 3), np.nan),
        "gait": np.arange(samples),
        "foothold_touchdown": touchdowns,
        "foothold_leg": np.arange(3),
    }
    return {**log, **changes}


def test_equal_logs_differ_in_nothing():
    assert differences(_log(5), _log(5)) == []


def test_the_last_bit_and_the_sign_of_zero_count():
    nudged = _log(5)["time"]
    nudged[3] = np.nextafter(nudged[3], 1.0)
    (line,) = differences(_log(5), _log(5, time=nudged))
    assert line.startswith("time[3]: ")
    assert "1 of 5 differ" in line
    assert differences(_log(5, p_WB=np.zeros(5)), _log(5, p_WB=np.array([0.0, 0.0, -0.0, 0.0, 0.0])))


def test_missing_arrays_and_other_types_and_lengths_count():
    without = _log(5)
    del without["gait"]
    assert differences(without, _log(5)) == ["gait: only in one of the logs"]
    assert differences(_log(5, gait=np.arange(5.0)), _log(5))
    assert len(differences(_log(5), _log(6))) == 3


def test_a_shorter_trial_is_the_beginning_of_a_longer_one():
    short = _log(6, foothold_touchdown=np.array([0.1, 0.4]), foothold_leg=np.arange(2))
    assert differences(short, _log(12), prefix=True) == []
    assert differences(_log(12), short, prefix=True) == []
    assert differences(short, _log(12, gait=np.arange(12) // 5), prefix=True)


@pytest.mark.parametrize(("samples", "options", "status"), [(5, [], 0), (6, [], 1), (6, ["--prefix"], 0)])
def test_the_exit_status_tells(tmp_path, capsys, samples, options, status):
    for name, number in (("a", 5), ("b", samples)):
        (tmp_path / name).mkdir()
        np.savez(tmp_path / name / "log.npz", **_log(number))
    assert main([str(tmp_path / "a"), str(tmp_path / "b"), *options]) == status
    assert ("equal" in capsys.readouterr().out) == (status == 0)


def test_what_is_not_there_cannot_be_compared(tmp_path, capsys):
    assert main([str(tmp_path), str(tmp_path)]) == 2
    assert "cannot be compared" in capsys.readouterr().err


def test_notes_are_compared_as_far_as_both_trials_went():
    def noted(samples, *notes):
        times, texts = zip(*notes, strict=True)
        return _log(samples, note_time=np.array(times), note_text=np.array(texts))

    short, longer = noted(6, (0.1, "a")), noted(12, (0.1, "a"), (0.9, "a longer one"))
    assert (
        differences(short | {"foothold_touchdown": np.array([0.1, 0.4]), "foothold_leg": np.arange(2)}, longer, prefix=True)
        == []
    )
    (line,) = differences(noted(6, (0.1, "a")), noted(6, (0.1, "b")))
    assert line == "note_text[0]: a and b; 1 of 1 differ"
