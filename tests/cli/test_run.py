"""``quadpips run``: what is refused and how; the configuration that comes out."""

import json
import os
import signal
import time

import pytest
import yaml
from typer.testing import CliRunner

from quadpips_drake.cli.main import app
from quadpips_drake.cli.run import default_directory, resolve_trial_config
from quadpips_drake.cli.trials import RunProgress
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.result import TrialResult

BAD_INPUT = [
    (["--robot", "spot"], ["unknown robot 'spot'", "anymal_c, go2"]),
    (["--terrain", "moon"], ["unknown terrain 'moon'", "flat", "stepping_stones"]),
    (["--terrain", "no_such_file.yaml"], ["no_such_file.yaml", "no such file"]),
    (["--planner", "magic"], ["unknown planner 'magic'", "quadpips"]),
    (["--set", "seed"], ["--set 'seed'", "key=value"]),
    (["--set", "sead=3"], ["unknown key 'sead'", "'seed'"]),
    (["--set", "duration=long"], ["'duration' must be a number"]),
    (["--set", "robot=spot"], ["unknown robot 'spot'"]),
    (["--start", "0,0"], ["--start '0,0'", "X,Y,YAW"]),
    (["--start", "0,0,north"], ["--start", "X,Y,YAW"]),
    (["--goal", "1,nan"], ["--goal '1,nan'", "X,Y"]),
    (["--goal", "1000,0", "--terrain", "flat"], ["goal"]),
    (["--start", "0.75,0.2,0"], ["start (0.75, 0.2)", "pit_floor"]),  # stepping_stones: over the pit
    (["--start", "-0.4,0,0", "--seed", "4"], ["seed 4 moves the start by", "start_position_noise"]),  # to the pit's edge
    (["--terrain", "balance_beam", "--difficulty", "3"], ["width of the beam must be 0.08 to 1 m, not 3"]),
    (["--terrain", "flat", "--difficulty", "0.3"], ["'flat' has no difficulty", "quadpips terrain list"]),
    (["--terrain", "course.yaml", "--difficulty", "0.3"], ["course.yaml", "a terrain file has none"]),
    (["--terrain", "gap", "--difficulty", "-1"], ["difficulty must be"]),
    (["--terrain", "gap", "--difficulty", "wide"], ["--difficulty", "valid number"]),
    (["--spawn", "box:0.3,0.3@1,0@4"], ["spawn 'box:0.3,0.3@1,0@4'", "a box needs box:L,W,H", "KIND:SIZE@foothold@TIME"]),
    (["--spawn", "box:0.3,0.3,0.2@1,0@t=120"], ["the time must be before the end of the trial, 120 s"]),
    (["--duration", "-1"], ["duration must be"]),
    (["--duration", "nan"], ["duration must be a positive number of seconds, not 'nan'"]),
    (["--duration", "soon"], ["--duration", "quadpips run --help"]),
    (["--sed", "3"], ["--sed", "--seed"]),
    (["no_such_scenario.yaml"], ["no_such_scenario.yaml", "no such file"]),
    (["--out", "/proc/nowhere"], ["--out /proc/nowhere", "writable"]),
    (["--out", ""], ["--out", "empty name"]),
    (["--out", 300 * "x"], ["--out xxx", "name too long"]),
    (["--terrain", "flat", "--meshcat-host", ""], ["Meshcat needs an address", "localhost"]),
    (["--terrain", "\x1b[31mred"], ["must be printable text", "'\\x1b[31mred'"]),
    (["\x1b[31mred.yaml"], ["error: \\x1b[31mred.yaml: no such file"]),
]


def quadpips(*arguments, cwd=None):
    """Runs the command line; returns exit status, stdout and stderr."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="quadpips")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.parametrize(("arguments", "parts"), BAD_INPUT, ids=lambda value: " ".join(value))
def test_bad_input_ends_with_one_line_and_status_2(arguments, parts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("quadpips_drake.trials.simulated_trial.Simulator", None)  # refused before anything is simulated
    status, _, errors = quadpips("run", "--no-recording", *arguments)
    lines = [line for line in errors.splitlines() if line.strip() and not line.startswith("building")]
    assert status == 2, errors
    assert len(lines) == 1, errors
    assert lines[0].startswith("error: ")
    for part in parts:
        assert part in lines[0]


def test_an_impossible_goal_is_recorded_in_the_result(tmp_path):
    status, _, _ = quadpips("run", "--no-recording", "--terrain", "flat", "--goal", "1000,0", "--out", tmp_path)
    result = json.loads((tmp_path / "result.json").read_text())
    assert status == 2
    assert not result["success"]
    assert result["reason"] == "error"
    assert "goal" in result["detail"]


def test_a_scenario_with_an_unknown_key_is_refused(tmp_path):
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text("robot: go2\nterain: flat\n")
    status, _, errors = quadpips("run", scenario)
    assert status == 2
    assert f"{scenario}: unknown key 'terain'; did you mean 'terrain'?" in " ".join(errors.split())


def test_options_lie_over_the_scenario_and_overrides_over_both(tmp_path):
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(yaml.safe_dump({"robot": "go2", "terrain": "flat", "seed": 1, "duration": 10.0}))
    config = resolve_trial_config(scenario, {"seed": 2, "duration": 20.0}, ["duration=30"])
    assert (config.robot, config.terrain, config.seed, config.duration) == ("go2", "flat", 2, 30.0)
    assert str(default_directory(config)) == "out/go2-flat-quadpips-2-duration=30"


def test_the_robot_is_checked_before_its_defaults_are_looked_for():
    with pytest.raises(UserInputError, match="there is no such file"):
        resolve_trial_config(None, {"robot": "../../etc"}, [])


def test_progress_prints_lines_where_no_bar_can_be_drawn(capsys):
    with RunProgress(20.0) as progress:
        for text in ("building", "building", "compiling"):
            progress.announce(text)
        for sim_time in range(12):
            time.sleep(0.001)
            progress(float(sim_time))
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 5, "what goes on before, then at 0, 5 and 10 s"
    assert lines[:2] == ["building", "compiling"]
    assert "real-time factor" not in lines[2], "nothing to tell yet"
    assert "10.0 of at most 20 s, real-time factor" in lines[-1]


def test_an_interrupted_run_says_where_the_rest_lies(tmp_path, monkeypatch):
    def interrupted(*_, **__):
        (tmp_path / "log.npz").write_text("")
        os.kill(os.getpid(), signal.SIGTERM)

    (tmp_path / "of_the_user.txt").write_text("")
    monkeypatch.setattr("quadpips_drake.trials.trial.run_trial", interrupted)
    status, _, errors = quadpips("run", "--terrain", "flat", "--out", tmp_path)
    assert status == 143
    assert errors.endswith(f"interrupted; what was simulated so far lies in {tmp_path}: log.npz\n")


def test_a_run_that_was_interrupted_before_it_began_names_no_files(tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("quadpips_drake.trials.trial.run_trial", interrupted)
    status, _, errors = quadpips("run", "--terrain", "flat", "--out", tmp_path)
    assert status == 130
    assert errors == "interrupted; nothing was written\n"


def test_explain_is_asked_for_and_the_page_is_named(tmp_path, monkeypatch):
    asked = []

    def run_trial(config, out, *, explain, **_):
        asked.append(explain)
        if explain:
            (out / "explain.html").write_text("")
        return TrialResult(True, "goal_reached", "anymal_c", "flat", sim_time=1.0)

    monkeypatch.setattr("quadpips_drake.trials.trial.run_trial", run_trial)
    _, output, _ = quadpips("run", "--terrain", "flat", "--out", tmp_path)
    assert "explain" not in output
    _, output, _ = quadpips("run", "--terrain", "flat", "--out", tmp_path, "--explain")
    assert "explained:" in output and "explain.html" in output
    assert asked == [False, True]


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["film", "."], "there is no config.yaml in it; give the directory of a run or a walk"),
        (["film", "missing"], "there is no config.yaml in it"),
        (["film", ".", "--fps", "-1"], "fps must be"),
        (["run", "--film", "a.mov"], "must end in .mp4 or .gif"),
        (["walk", "--film", "missing/a.mp4"], "there is no directory missing"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_film_that_cannot_be_is_refused_at_once(arguments, part, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("quadpips_drake.trials.simulated_trial.Simulator", None)
    status, _, errors = quadpips(*arguments)
    assert status == 2, errors
    (line,) = [line for line in errors.splitlines() if line.strip()]
    assert line.startswith("error: ") and part in line
    assert not list(tmp_path.iterdir())
