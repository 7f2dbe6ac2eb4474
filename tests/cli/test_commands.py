"""The other commands, and what all have in common."""

import pickle
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from quadpips_drake import __version__
from quadpips_drake.cli import console, doctor
from quadpips_drake.cli.main import app
from quadpips_drake.errors import UserInputError
from quadpips_drake.solvers.missing_solver import MissingSolverError
from quadpips_drake.trials.warming import warm_up as warming

COMMANDS = ["run", "bench", "terrain", "diagram", "doctor"]


def quadpips(*arguments):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="quadpips")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


def test_help_lists_the_commands():
    done = subprocess.run([sys.executable, "-m", "quadpips_drake.cli.main", "--help"], capture_output=True, text=True)
    assert done.returncode == 0
    for command in COMMANDS:
        assert re.search(rf"│ {command}\b", done.stdout)


def test_help_is_quick():
    """Heavy modules are imported inside the commands."""
    code = "import sys, quadpips_drake.cli.main; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"pydrake", "torch", "matplotlib", "scipy", "cv2"} & set(done.stdout.split())


def test_help_imports_nothing_heavy():
    code = "import sys, quadpips_drake.cli.main; print([m for m in ('numpy', 'pydrake', 'numba') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_explains_itself(command):
    status, output, _ = quadpips(command, "--help")
    assert status == 0
    assert "Usage: quadpips" in output


def test_version():
    assert quadpips("--version")[:2] == (0, f"quadpips_drake {__version__}\n")


@pytest.mark.parametrize("arguments", [["rum"], ["run", "--sed", "1"], ["diagram"], ["terrain", "shaw"]])
def test_usage_errors_are_one_line(arguments):
    status, _, errors = quadpips(*arguments)
    assert status == 2
    assert errors.startswith("error: ")
    assert errors.count("\n") == 1


def test_numbers_are_read_exactly():
    assert console.numbers("--goal", "1.5,-2", "X,Y") == [1.5, -2.0]
    for text in ("", "1", "1,2,3", "1;2", "1,inf", "a,b"):
        with pytest.raises(UserInputError, match="X,Y"):
            console.numbers("--goal", text, "X,Y")


def test_control_characters_are_shown_and_not_obeyed(capsys):
    name = "stones\x1b[2J\x1b]0;title\x07\x9b31m\u202eevil\ttab"
    shown = "stones\\x1b[2J\\x1b]0;title\\x07\\x9b31m\\u202eevil\ttab"
    assert console.printable(name) == shown
    assert console.printable("Größe 3 µm\n") == "Größe 3 µm\n"
    console.say(name)
    console.messages.print(name, markup=False)
    console.print_error(name)
    out, err = capsys.readouterr()
    assert out == shown + "\n"
    assert "\x1b" not in err and "\x07" not in err
    assert err.count("stones\\x1b[2J") == 2


@pytest.mark.parametrize("error", [EOFError, pickle.UnpicklingError])
def test_damaged_kernels_are_one_line(error, monkeypatch):
    def load(*_, **__):
        raise error("truncated")

    monkeypatch.setattr("quadpips_drake.terrain.library.load_terrain", load)
    monkeypatch.setattr("quadpips_drake.compiling.remove_broken_kernels", lambda: ["a.nbi", "a.1.nbc"])
    status, _, errors = quadpips("terrain", "list")
    assert status == 1
    assert errors.startswith("error: 2 damaged files were in the cache of compiled kernels; now run")


def test_an_unknown_diagram_lists_the_known_ones():
    status, _, errors = quadpips("diagram", "engine")
    assert status == 2
    assert "known: em_mpc, lf_mpc, motion_models, perception, planning, quadpips, s_mpc, station, tracking, walk" in errors


def test_a_diagram_of_unknown_format_is_refused():
    status, _, errors = quadpips("diagram", "station", "--out", "station.bmp")
    assert status == 2
    assert ".svg" in errors


@pytest.mark.parametrize("name", ["station", "perception", "planning", "tracking", "quadpips", "s_mpc"])
def test_a_diagram_is_drawn(name, tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.which", lambda program: None)  # without Graphviz, the dot file and a line that says so
    status, output, errors = quadpips("diagram", name, "--out", tmp_path / f"{name}.svg")
    assert status == 0, errors
    assert "apt install graphviz" in output
    assert (tmp_path / f"{name}.dot").read_text().startswith("digraph")


def test_doctor_reports_failures_with_their_remedy(monkeypatch):
    def fails():
        raise doctor.CheckFailed("it is broken")

    def misses():
        raise MissingSolverError("it is missing")

    sound, broken = doctor.Check("sound", lambda: "well", ""), doctor.Check("broken", fails, "mend it")
    checks = [sound, broken, doctor.Check("rare", misses, "", optional=True)]
    monkeypatch.setattr(doctor, "checks", lambda: iter(checks))
    status, output, _ = quadpips("doctor")
    assert status == 1
    assert output.splitlines() == [
        "OK   sound: well",
        "FAIL broken: it is broken",
        "     -> mend it",
        "NOTE rare: it is missing",
        "1 of 3 checks failed",
    ]
    checks.remove(broken)
    assert quadpips("doctor")[0] == 0, "what is optional does not fail"


def test_doctor_tells_cold_kernels_from_warm_ones(monkeypatch):
    check = doctor.Check("compiled kernels", doctor._kernels, "")
    monkeypatch.setattr(warming, "cold_groups", lambda: ["perception", "planning"])
    verdict, remark = doctor.outcome(check)
    assert verdict == doctor.NOTE and "perception, planning; the first run does it" in remark
    monkeypatch.setattr(warming, "cold_groups", list)
    assert doctor.outcome(check)[0] == doctor.OK


def test_doctor_warms(monkeypatch):
    errors = {"planning": RuntimeError("there is no\nground")}

    def warm_up(told):
        told(["perception", "planning"], 0, 2)
        return errors

    monkeypatch.setattr(warming, "cold_groups", lambda: ["perception", "planning"])
    monkeypatch.setattr(warming, "warm_up_in_parallel", warm_up)
    status, output, messages = quadpips("doctor", "--warm")
    assert (status, output) == (1, "")
    assert messages.splitlines()[:2] == [
        "compiling numerical kernels, once for this machine: perception, planning",
        "planning: not compiled ahead (there is no ground); it is compiled when it is needed",
    ]
    errors.clear()
    assert quadpips("doctor", "--warm")[0] == 0
    monkeypatch.setattr(warming, "cold_groups", list)
    assert quadpips("doctor", "--warm") == (0, "", "")


def _end_abruptly():
    import os

    os.abort()


def test_doctor_survives_a_check_that_ends_its_process():
    verdict, remark = doctor.outcome(doctor.Check("crash", _end_abruptly, "", isolated=True))
    assert verdict == doctor.FAIL
    assert "abruptly" in remark


@pytest.mark.parametrize("solver", ["piqp", "proxqp", "osqp", "clarabel"])
def test_doctor_finds_each_solver_able(solver):
    assert "solves" in doctor._solve(solver)


def test_doctor_renders_and_stands():
    assert "rendered" in doctor._render()
    assert "upright" in doctor._stand()


def test_every_command_prints_through_the_console():
    """There control characters are shown; the version is the one thing that is not."""
    folder = Path(console.__file__).parent
    others = [path.name for path in folder.rglob("*.py") if "typer.echo(" in path.read_text(encoding="utf-8")]
    assert sorted(others) == ["console.py", "main.py"]
