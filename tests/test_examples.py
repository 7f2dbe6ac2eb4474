"""The examples run as they are."""

import runpy
import sys

import pytest

from tests.source_tree import ROOT

EXAMPLES = {"stand_and_look.py": ["flat", "go2", "depth.png"]}
"""Example -> arguments that keep it short."""


def test_each_example_is_tried():
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_runs(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name, *EXAMPLES[name]])
    runpy.run_path(str(ROOT / "examples" / name), run_name="__main__")
    assert "see something" in capsys.readouterr().out
    assert (tmp_path / "depth.png").stat().st_size > 0
