"""The examples run as they are, explain themselves, and say in one line what they cannot do."""

import runpy
import sys

import pytest

from tests.source_tree import ROOT

STILL = ["--terrain", "flat", "--robot", "go2", "--picture", "picture.png"]
EXAMPLES = {
    "stand_and_look.py": (STILL, "see something", "picture.png"),
    "perception_on_a_still_scene.py": (STILL, "regions in all", "picture.png"),
    "pictures_of_a_trial.py": (
        ["--terrain", "flat", "--duration", "1.6", "--pictures", "2", "--out", "pictures"],
        "timeout",
        "pictures/film.png",
    ),
    "run_in_ten_lines.py": (["0.3"], "timeout", None),
    "stance_limits.py": (["--robot", "go2", "--picture", "picture.png"], "max_width", "picture.png"),
}
"""Example -> arguments that keep it short, a part of what it prints, and a file that it writes."""
WITH_OPTIONS = [name for name in EXAMPLES if name not in ("run_in_ten_lines.py", "stance_limits.py")]


def run(name, arguments, tmp_path, monkeypatch):
    """Runs an example; returns its exit status."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name, *arguments])
    try:
        runpy.run_path(str(ROOT / "examples" / name), run_name="__main__")
    except SystemExit as end:
        return end.code
    return 0


def test_each_example_is_tried():
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_runs(name, tmp_path, monkeypatch, capsys):
    arguments, printed, written = EXAMPLES[name]
    assert run(name, arguments, tmp_path, monkeypatch) == 0
    assert printed in capsys.readouterr().out
    assert written is None or (tmp_path / written).stat().st_size > 0


@pytest.mark.parametrize("name", WITH_OPTIONS)
def test_an_example_explains_itself(name, tmp_path, monkeypatch, capsys):
    assert run(name, ["--help"], tmp_path, monkeypatch) == 0
    assert "--terrain" in capsys.readouterr().out


@pytest.mark.parametrize("name", WITH_OPTIONS)
def test_an_unknown_terrain_is_one_line(name, tmp_path, monkeypatch, capsys):
    assert run(name, ["--terrain", "moon"], tmp_path, monkeypatch) == 2
    errors = [line for line in capsys.readouterr().err.splitlines() if line.strip()]
    assert errors[-1].startswith("error: unknown terrain 'moon'") and "Traceback" not in "".join(errors)
