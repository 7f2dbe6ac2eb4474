"""The recipes of docs/extending.md run as they are."""

import re

import pytest

import quadpips_drake as qp
from tests.source_tree import ROOT

PAGE = ROOT / "docs" / "extending.md"
ADDED = {
    "terrains": ["two_slabs", "wider_slabs"],
    "region_sources": ["carpet"],
    "planners": ["straight"],
    "state_estimators": ["late_truth"],
    "gaits": ["bound"],
    "qp_solvers": ["my_osqp"],
}
"""What the recipes add, to be taken out again."""


@pytest.fixture
def registries():
    yield qp.registries
    for registry, names in ADDED.items():
        for name in names:
            getattr(qp.registries, registry).remove(name)


def test_the_recipes_run(registries, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text(encoding="utf-8")
    names = {"__name__": "recipes"}
    for match in re.finditer(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        # Empty lines put the code on its line of the page, for tracebacks.
        code = "\n" * (text[: match.start()].count("\n") + 1) + match.group(1)
        exec(compile(code, str(PAGE), "exec"), names)
    assert "observed_station.foot_contacts carries FootContacts" in capsys.readouterr().out
    for registry, added in ADDED.items():
        assert set(added) <= set(getattr(registries, registry).names())
