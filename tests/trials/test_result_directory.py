"""Whose directory it is."""

import subprocess
import sys

import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.result_directory import ResultDirectory

HOLD = """
import sys, time
from quadpips_drake.trials.result_directory import ResultDirectory
with ResultDirectory(sys.argv[1]):
    print("held", flush=True)
    time.sleep(60)
"""


def test_the_lock_of_a_killed_process_is_free(tmp_path):
    holder = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    try:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(UserInputError, match="another process"), ResultDirectory(tmp_path):
            pass
    finally:
        holder.kill()
        holder.wait()
        holder.stdout.close()
    with ResultDirectory(tmp_path) as directory:
        assert directory.present() == []


@pytest.mark.parametrize("name", ["result.json", "log.npz"])
def test_a_directory_in_the_place_of_a_file_is_refused(name, tmp_path):
    (tmp_path / name).mkdir()
    with pytest.raises(UserInputError, match=f"{name} in it is no file"), ResultDirectory(tmp_path, overwrite=True):
        pass
    assert (tmp_path / name).is_dir()


@pytest.mark.parametrize("name", ["x" * 300, "/proc/nowhere", "/dev/null/x"])
def test_what_cannot_be_a_directory_is_refused(name, tmp_path):
    with pytest.raises(UserInputError, match="cannot write there"), ResultDirectory(tmp_path / name):
        pass


def test_nothing_is_removed_before_it_is_cleared(tmp_path):
    for name in ("result.json", "recording.html", "error.txt", "notes.txt"):
        (tmp_path / name).write_text("{}")
    with ResultDirectory(tmp_path, overwrite=True) as directory:
        assert directory.present() == ["result.json", "recording.html", "error.txt"]
        directory.clear()
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_an_empty_directory_that_was_not_there_goes_again(tmp_path):
    with ResultDirectory(tmp_path / "new"):
        assert (tmp_path / "new").is_dir()
    assert not (tmp_path / "new").exists()
    with ResultDirectory(tmp_path):
        pass
    assert tmp_path.is_dir()
