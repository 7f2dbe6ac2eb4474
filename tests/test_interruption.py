"""Ending early: which signals count, what a second one does, what is told to the shell."""

import os
import signal
import subprocess
import sys
from contextlib import suppress

import pytest

from quadpips_drake import interruption
from quadpips_drake.interruption import Terminated, exit_status, interruptible, undisturbed


def send(number):
    """Sends this process a signal, which is handled before this returns."""
    os.kill(os.getpid(), number)


def test_sigterm_ends_a_block_like_ctrl_c():
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt) as caught, interruptible():
        send(signal.SIGTERM)
    assert isinstance(caught.value, Terminated)
    assert str(caught.value) == "SIGTERM"
    assert exit_status(caught.value) == 143
    assert signal.getsignal(signal.SIGTERM) == before


def test_ctrl_c_keeps_its_exit_status():
    with pytest.raises(KeyboardInterrupt) as caught, interruptible():
        send(signal.SIGINT)
    assert exit_status(caught.value) == 130


@pytest.mark.parametrize("second", [signal.SIGINT, signal.SIGTERM])
def test_a_second_signal_does_not_disturb_those_who_clean_up(second, capfd):
    saved = []
    with pytest.raises(KeyboardInterrupt), interruptible():
        try:
            send(signal.SIGINT)
        finally:
            send(second)
            saved.append("log")
    assert saved == ["log"]
    assert "being written" in capfd.readouterr().err


def test_patience_has_an_end(monkeypatch):
    monkeypatch.setattr(interruption, "PATIENCE", 0.0)
    with pytest.raises(Terminated), interruptible():
        try:
            send(signal.SIGINT)
        finally:
            send(signal.SIGTERM)


def test_files_are_written_undisturbed_with_or_without_the_command_line(capfd):
    written = []
    with undisturbed():
        send(signal.SIGINT)
        send(signal.SIGTERM)
        written.append("log")
    assert written == ["log"]
    assert capfd.readouterr().err.count("being written") == 2


def test_an_interruption_that_got_lost_is_raised_again():
    with interruptible():
        interruption.check()
        with suppress(KeyboardInterrupt):  # as Python does in destructors
            send(signal.SIGTERM)
        with pytest.raises(Terminated):
            interruption.check()
    with interruptible():
        interruption.check()


def test_who_was_started_to_ignore_a_signal_goes_on_ignoring_it():
    code = (
        "import os, signal; from quadpips_drake.interruption import interruptible\n"
        "signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "with interruptible(): os.kill(os.getpid(), signal.SIGHUP)\n"
        "print('still there')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "still there\n"
