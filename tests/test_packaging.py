"""A wheel that is built from the sources holds everything that runs need."""

import shutil
import subprocess
import sys
import tomllib
import zipfile
from itertools import chain

import pytest

from tests.source_tree import ROOT, files

MAPPED = {"quadpips_drake": "quadpips_drake", "diagrams": "quadpips_drake/diagrams", "models": "quadpips_drake/models"}
"""Folder in the repository -> folder in the wheel."""


@pytest.fixture(scope="module")
def wheel_content(tmp_path_factory):
    """Names of the files in a wheel built from a copy of the sources, without network."""
    folder = tmp_path_factory.mktemp("packaging")
    sources = folder / "sources"
    for name in MAPPED:
        shutil.copytree(ROOT / name, sources / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, sources)
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-index", "--no-build-isolation", "-w"]
    done = subprocess.run([*command, str(folder), str(sources)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def test_wheel_holds_all_modules_and_models(wheel_content):
    expected = {
        f"{target}/{path.relative_to(ROOT / folder).as_posix()}"
        for folder, target in MAPPED.items()
        for path in files("*")
        if path.is_relative_to(ROOT / folder)
    }
    assert expected - wheel_content == set()
    assert any(name.endswith(".urdf") for name in wheel_content)
    assert any(name.endswith("licenses/LICENSE") for name in wheel_content)


def test_pinned_versions_cover_the_direct_dependencies():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = [*project["dependencies"], *chain.from_iterable(project["optional-dependencies"].values())]
    direct = [name for name in named if not name.startswith(project["name"])]  # extras name each other
    pinned = {line.split("==")[0].lower() for line in (ROOT / "constraints.txt").read_text().splitlines() if "==" in line}
    assert {name.split(">")[0].lower() for name in direct} <= pinned
