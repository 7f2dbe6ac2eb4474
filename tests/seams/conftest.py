"""A package from outside, installed for the tests of this folder."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import quadpips_drake as qp
from tests.source_tree import ROOT

SOURCES = Path(__file__).parent / "scratch_package"
NAMES = {
    "planners": "straight",
    "region_sources": "carpet",
    "state_estimators": "stuck_clock",
    "robots": "long_dog",
    "terrains": "two_slabs",
}
"""What the package brings to which registry."""


@pytest.fixture(scope="session")
def site(tmp_path_factory) -> Path:
    """A directory in which pip has installed the scratch package, its robot's files made of the Go2's."""
    folder = tmp_path_factory.mktemp("scratch")
    package = folder / "sources" / "scratch_package"
    shutil.copytree(SOURCES, folder / "sources", ignore=shutil.ignore_patterns("__pycache__"))
    go2 = ROOT / "models" / "go2"
    shutil.copy(go2 / "go2.urdf", package / "long_dog.urdf")
    shutil.copy(go2 / "defaults.yaml", package / "defaults.yaml")
    text = (go2 / "robot.yaml").read_text().replace("go2.urdf", "long_dog.urdf").replace("Unitree Go2", "Long dog")
    (package / "long_dog.yaml").write_text(text)
    command = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-index", "--no-build-isolation", "--target"]
    done = subprocess.run([*command, str(folder / "site"), str(folder / "sources")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "site"


@pytest.fixture
def scratch_package(site, monkeypatch):
    """The package, importable and known to all registries."""
    monkeypatch.syspath_prepend(site)
    yield
    for registry, name in NAMES.items():
        getattr(qp.registries, registry).remove(name)
