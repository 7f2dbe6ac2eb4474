"""The notebooks run from top to bottom, with short settings where their cells name some, and show pictures."""

import json

import pytest
from nbmake.nb_run import NotebookRun

from tests.source_tree import ROOT

FOLDER = ROOT / "examples" / "notebooks"
NOTEBOOKS = sorted(path.name for path in FOLDER.glob("*.ipynb"))
LONGEST_CELL = 300
"""Wall-clock time after which a cell counts as stuck [s]."""
MAX_BYTES = 300_000


def cells(name: str, kind: str) -> list[dict]:
    """The cells of a notebook that are "code" or "markdown"."""
    content = json.loads((FOLDER / name).read_text(encoding="utf-8"))
    return [cell for cell in content["cells"] if cell["cell_type"] == kind]


@pytest.mark.slow
@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_and_shows_pictures(name):
    result = NotebookRun(FOLDER / name, LONGEST_CELL).execute()
    assert result.error is None, result.error.trace
    outputs = [output for cell in result.nb.cells for output in cell.get("outputs", ())]
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 2


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_is_kept_without_outputs(name):
    code = cells(name, "code")
    assert not any(cell["outputs"] or cell["execution_count"] for cell in code)
    assert (FOLDER / name).stat().st_size < MAX_BYTES
    assert "".join(code[0]["source"]).startswith("%matplotlib inline\n")


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_has_a_title_and_is_in_the_tutorial(name):
    assert cells(name, "markdown")[0]["source"][0].startswith("# ")
    assert f"examples/notebooks/{name})" in (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")


def test_there_are_notebooks():
    assert len(NOTEBOOKS) >= 6
