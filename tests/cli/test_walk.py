"""``quadpips walk``: what is refused and how; what a short walk leaves behind."""

import json
import signal
import subprocess
import sys

import numpy as np
import pytest
import yaml

from tests.cli.test_run import quadpips

BAD_INPUT = [
    (["--robot", "spot"], ["unknown robot 'spot'", "anymal_c, go2"]),
    (["--gait", "gallop"], ["unknown gait 'gallop'", "trot", "static_walk", "flying_trot"]),
    (["--terrain", "moon"], ["unknown terrain 'moon'", "bumps", "slope"]),
    (["--velocity", "0.3"], ["--velocity '0.3'", "VX,VY,WZ"]),
    (["--velocity", "fast,0,0"], ["--velocity", "VX,VY,WZ"]),
    (["--push", "100,0,0"], ["--push '100,0,0'", "N,E,W,T0,DT"]),
    (["--push", "100,0,0,1,0"], ["push", "duration must be"]),
    (["--duration", "-1"], ["duration must be"]),
    (["--start", "100,0,0"], ["start", "off the terrain"]),
    (["--set", "stages.station.model_error.friction=-1"], ["friction"]),
    (["--terrain", "bumps", "--difficulty", "9"], ["height of the bumps must be 0 to 0.2 m, not 9"]),
    (["--set", "stages.planning=1"], ["stages.planning"]),
    (["--set", "changes=[{time: 3, gait: gallop}]"], ["unknown gait 'gallop'"]),
]


@pytest.mark.parametrize(("arguments", "parts"), BAD_INPUT, ids=lambda value: " ".join(value))
def test_bad_input_ends_with_one_line_and_status_2(arguments, parts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("quadpips_drake.trials.simulated_trial.Simulator", None)  # refused before anything is simulated
    status, _, errors = quadpips("walk", "--no-recording", *arguments)
    lines = [line for line in errors.splitlines() if line.strip() and not line.startswith("building")]
    assert status == 2, errors
    assert len(lines) == 1, errors
    assert lines[0].startswith("error: ")
    for part in parts:
        assert part in lines[0]


def test_a_short_walk_leaves_its_files(tmp_path):
    arguments = [
        "--robot",
        "go2",
        "--velocity",
        "0.2,0,0",
        "--duration",
        "1.2",
        "--push",
        "5,0,0,0.8,0.1",
        "--profile",
        "--out",
        tmp_path,
    ]
    status, output, _ = quadpips("walk", *arguments)
    assert status == 0
    assert "success: upright after 1.2 s" in output
    assert f"profile:   {tmp_path / 'profile.html'} (open it in a browser)" in output
    pages = {"recording.html", "report.html", "story.json", "profile.html", "profile.json"}
    results = {"result.json", "config.yaml", "log.npz", *pages}
    assert {path.name for path in tmp_path.iterdir()} == results
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["success"]
    assert (result["reason"], result["robot"], result["terrain"]) == ("upright", "go2", "flat")
    assert result["walk"]["commands"][0]["velocity"] == [0.2, 0.0, 0.0]
    assert result["walk"]["max_tilt"] < 0.1
    assert result["fallbacks"] == {"mpc": 0, "wbc": 0}
    config = yaml.safe_load((tmp_path / "config.yaml").read_text())
    assert config["gait"] == "trot"
    assert config["pushes"][0]["force"] == [5.0, 0.0, 0.0]
    with np.load(tmp_path / "log.npz") as log:
        pushed = log["time"][log["push"][:, 0] > 0]
        assert pushed.min() == pytest.approx(0.8)
        assert pushed.max() == pytest.approx(0.89)


@pytest.mark.parametrize(
    ("command", "other", "text"),
    [
        ("run", "walk", "gait: trot\nvelocity: [0.3, 0.0, 0.0]\n"),
        ("run", "walk", "stages: {velocity_reference: {leash: 0.1}}\n"),
        ("walk", "run", "goal: [1.0, 0.0]\n"),
    ],
)
def test_a_configuration_for_the_other_command_is_called_so(command, other, text, tmp_path):
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(text)
    status, _, errors = quadpips(command, scenario)
    assert status == 2
    assert errors == f"error: {scenario}: this is a configuration for 'quadpips {other}'; use that\n"
    scenario.write_text("seed: 1\n")  # fits both
    status, _, errors = quadpips(command, scenario, "--robot", "spot")
    assert "unknown robot 'spot'" in errors


def test_sigterm_ends_a_walk_with_its_files_though_it_comes_twice(tmp_path):
    arguments = ["walk", "--robot", "go2", "--duration", "600", "--no-recording", "--out", str(tmp_path)]
    with subprocess.Popen(
        [sys.executable, "-m", "quadpips_drake.cli.main", *arguments], stderr=subprocess.PIPE, text=True
    ) as walk:
        try:
            while "of at most" not in (line := walk.stderr.readline()):
                assert line, "it ended by itself"
            walk.send_signal(signal.SIGTERM)
            walk.send_signal(signal.SIGINT)
            errors = walk.communicate(timeout=60)[1]
        finally:
            walk.kill()
    assert walk.returncode in (130, 143), "whichever the system delivers first"
    files = "config.yaml, log.npz, report.html, result.json, story.json"
    assert f"interrupted; what was simulated so far lies in {tmp_path}: {files}" in errors
    result = json.loads((tmp_path / "result.json").read_text())
    assert (result["success"], result["reason"]) == (False, "interrupted")
    with np.load(tmp_path / "log.npz") as log:
        assert log["time"][-1] == pytest.approx(result["sim_time"], abs=0.011)


def test_a_command_beyond_the_legs_is_told(tmp_path):
    arguments = ["--robot", "go2", "--velocity", "50,0,0", "--duration", "1.0", "--no-recording", "--out", tmp_path]
    _, output, _ = quadpips("walk", *arguments)
    assert "50.00, 0.00, 0.00 was asked of trot; the legs allow" in output
    (command,) = json.loads((tmp_path / "result.json").read_text())["walk"]["commands"]
    assert command["velocity"] == [50.0, 0.0, 0.0]
    assert command["feasible_velocity"][0] < 3.0


def test_a_saved_walk_can_be_walked_again(tmp_path):
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text("robot: go2\ngait: gallop\n")
    status, _, errors = quadpips("walk", scenario)
    assert status == 2
    assert "unknown gait 'gallop'" in errors
