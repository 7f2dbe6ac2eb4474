"""The examples run as they are, explain themselves, and say in one line what they cannot do."""

import runpy
import sys

import pytest

from tests.source_tree import ROOT

STILL = ["--terrain", "flat", "--robot", "go2", "--picture", "picture.png"]
EXAMPLES = {
    "stand_and_look.py": (STILL, ("building", "standing", "see something", "wrote"), "picture.png"),
    "perception_on_a_still_scene.py": (STILL, ("building", "looking", "regions in all", "wrote"), "picture.png"),
    "pictures_of_a_trial.py": (
        ["--terrain", "flat", "--duration", "1.6", "--pictures", "2", "--out", "pictures"],
        ("building", "timeout", "drawing", "pictures:"),
        "pictures/film.png",
    ),
    "run_in_ten_lines.py": (["--terrain", "flat", "--duration", "0.3"], ("building", "walking", "timeout", "samples"), None),
    "stance_limits.py": (["--robot", "go2", "--picture", "picture.png"], ("trying", "max_width", "wrote"), "picture.png"),
}
"""Example -> arguments that keep it short, parts of what it says in this order, and a file that it writes."""
OPTIONS = {name: ("--robot", "--terrain") if name != "stance_limits.py" else ("--robot",) for name in EXAMPLES}
"""Example -> options that take a name."""
WITH_NAMES = [(name, option) for name, options in OPTIONS.items() for option in options]
WITH_PICTURE = [name for name, (arguments, *_) in EXAMPLES.items() if "--picture" in arguments]


def run(name, arguments, tmp_path, monkeypatch):
    """Runs an example; returns its exit status."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name, *arguments])
    try:
        runpy.run_path(str(ROOT / "examples" / name), run_name="__main__")
    except SystemExit as end:
        return end.code
    return 0


def one_line(capsys) -> str:
    """What was said on stderr, which must be one line."""
    errors = [line for line in capsys.readouterr().err.splitlines() if line.strip()]
    assert len(errors) == 1, errors
    return errors[0]


def test_each_example_is_tried():
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_runs_and_says_what_it_does(name, tmp_path, monkeypatch, capsys):
    arguments, said, written = EXAMPLES[name]
    assert run(name, arguments, tmp_path, monkeypatch) == 0
    output = capsys.readouterr().out
    places = [output.find(part) for part in said]
    assert places == sorted(places) and places[0] >= 0, output
    assert written is None or (tmp_path / written).stat().st_size > 0


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_explains_itself(name, tmp_path, monkeypatch, capsys):
    assert run(name, ["--help"], tmp_path, monkeypatch) == 0
    output = capsys.readouterr().out
    assert all(option in output for option in OPTIONS[name])


@pytest.mark.parametrize(("name", "option"), WITH_NAMES)
def test_an_unknown_name_is_one_line(name, option, tmp_path, monkeypatch, capsys):
    assert run(name, [option, "moon"], tmp_path, monkeypatch) == 2
    assert one_line(capsys).startswith(f"error: unknown {option.removeprefix('--')} 'moon'")


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_unknown_option_is_one_line(name, tmp_path, monkeypatch, capsys):
    assert run(name, ["--moon"], tmp_path, monkeypatch) == 2
    assert one_line(capsys).startswith("error: No such option: --moon")


@pytest.mark.parametrize("name", WITH_PICTURE)
def test_a_picture_that_cannot_be_written_is_one_line(name, tmp_path, monkeypatch, capsys):
    assert run(name, ["--picture", "picture.moon"], tmp_path, monkeypatch) == 2
    assert one_line(capsys).startswith("error: --picture picture.moon: the name of a picture must end in .png")
    (tmp_path / "file").touch()
    assert run(name, ["--picture", "file/picture.png"], tmp_path, monkeypatch) == 2
    assert one_line(capsys).startswith("error: --picture file: cannot write there")
