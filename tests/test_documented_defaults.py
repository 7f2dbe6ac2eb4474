"""Tables of keys in the documentation show the defaults that the configuration has."""

import re

import pytest
import yaml

from quadpips_drake.configuration.loading import load_config
from quadpips_drake.diagrams.quadpips import QuadpipsConfig
from quadpips_drake.robots.robot_library import robot_defaults_layer
from tests.source_tree import ROOT

ROBOTS = ("anymal_c", "go2")
PAGES = ("docs/planning.md", "docs/trajectory.md")
ROW = re.compile(r"^\| `(\w+\.[\w.]+)` \| ([^|]+) \| ([^|]+) \|", re.MULTILINE)


def value_at(config, key: str):
    """The value below the dotted ``key``."""
    for name in key.split("."):
        config = getattr(config, name)
    return config


@pytest.fixture(scope="module")
def configurations():
    return {robot: load_config(QuadpipsConfig, [robot_defaults_layer(robot)]) for robot in ROBOTS}


@pytest.mark.parametrize("page", PAGES)
def test_documented_defaults_are_those_of_the_configuration(page, configurations):
    rows = ROW.findall((ROOT / page).read_text(encoding="utf-8"))
    assert len(rows) > 10
    wrong = []
    for key, *documented in rows:
        for robot, text in zip(ROBOTS, documented, strict=True):
            value = value_at(configurations[robot], key)
            wrong += [] if yaml.safe_load(text) == value else [f"{key}: {value} for {robot}, documented as {text}"]
    assert not wrong, "\n".join(wrong)
