"""The examples run as they are."""

import runpy
import sys

import pytest

from tests.source_tree import ROOT

EXAMPLES = {
    "stand_and_look.py": (["flat", "go2", "depth.png"], "see something"),
    "perception_on_a_still_scene.py": (["flat", "go2", "depth.png"], "regions in all"),
}
"""Example -> arguments that keep it short, and a part of what it prints; each writes depth.png."""
WITHOUT_PICTURE = {"run_in_ten_lines.py": (["0.3"], "timeout")}
"""The same for those that draw nothing."""
TOO_LONG = {"pictures_of_a_trial.py"}
"""Simulates a whole trial."""


def test_each_example_is_tried():
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == {*EXAMPLES, *WITHOUT_PICTURE, *TOO_LONG}


@pytest.mark.parametrize("name", [*EXAMPLES, *WITHOUT_PICTURE])
def test_an_example_runs(name, tmp_path, monkeypatch, capsys):
    arguments, printed = {**EXAMPLES, **WITHOUT_PICTURE}[name]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name, *arguments])
    runpy.run_path(str(ROOT / "examples" / name), run_name="__main__")
    assert printed in capsys.readouterr().out
    assert name in WITHOUT_PICTURE or (tmp_path / "depth.png").stat().st_size > 0
