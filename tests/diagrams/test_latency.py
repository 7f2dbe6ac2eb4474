"""Every rate and latency of the configuration belongs to a stage that keeps to it."""

import dataclasses

import pytest
from pydrake.systems.framework import Diagram

from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.control.whole_body.whole_body_controller_system import WholeBodyController
from quadpips_drake.diagrams.quadpips import QuadpipsConfig, QuadpipsDiagram
from quadpips_drake.diagrams.walk import WalkConfig, WalkDiagram
from quadpips_drake.framework.stage import Stage
from quadpips_drake.framework.stage_config import StageConfig
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from tests.diagrams.fed_stages import FIXED, STAGES, outputs_over_time
from tests.source_tree import package_modules

RATE, LATENCY, STEP = 20.0, 0.08, 0.01
"""[Hz], [s]; the inputs change every STEP [s]."""
LATE = round(LATENCY / STEP)
SAMPLES = 30
AT_ONCE = {"safe_reference"}
"""Outputs that look at an input directly, without delay, and only what they make of it is remembered."""


def stage_classes() -> set[type]:
    """Every stage that is defined in the package."""
    members = [member for module in package_modules() for member in vars(module).values() if isinstance(member, type)]
    return {cls for cls in members if issubclass(cls, Stage) and cls is not Stage}


def test_no_stage_is_missing_here():
    missing = sorted(cls.__name__ for cls in stage_classes() - STAGES.keys() - FIXED)
    assert not missing, f"say in tests/diagrams/fed_stages.py how to make and to feed {missing}"


@pytest.mark.parametrize("cls", STAGES, ids=lambda cls: cls.__name__)
def test_latency_delays_every_output_and_nothing_else(cls):
    prompt = outputs_over_time(cls, STEP, SAMPLES, rate=RATE, latency=0.0)
    late = outputs_over_time(cls, STEP, SAMPLES, rate=RATE, latency=LATENCY)
    updates = round(SAMPLES * STEP * RATE)
    assert max(len(set(seen)) for name, seen in prompt.items() if name not in AT_ONCE) >= updates - 1
    for name in prompt.keys() - AT_ONCE:
        assert late[name][LATE:] == prompt[name][:-LATE], name
        assert len(set(late[name][:LATE])) == 1, f"{name} shows something before its time"
    for name in prompt.keys() & AT_ONCE:
        assert late[name] == prompt[name]


def test_a_first_result_before_the_first_step_is_never_late():
    """The robot must have torques when the physics begins."""
    seen = outputs_over_time(WholeBodyController, STEP, 2, rate=RATE, latency=LATENCY)
    assert seen["wbc_status"][0] == (0.0,)


def sections(config, path="") -> dict[str, StageConfig]:
    """The stages' configurations in a tree of dataclasses, by their keys."""
    found = {path: config} if isinstance(config, StageConfig) else {}
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            found |= sections(value, f"{path}.{field.name}" if path else field.name)
    return found


def stages_of(diagram: Diagram) -> list[Stage]:
    """All stages in a diagram, at any depth."""
    found = []
    for system in diagram.GetSystems():
        found += stages_of(system) if isinstance(system, Diagram) else [system] if isinstance(system, Stage) else []
    return found


def test_every_section_of_the_configuration_is_that_of_a_stage():
    robot, terrain = load_robot("anymal_c"), load_terrain("flat")
    config, walk = QuadpipsConfig(), WalkConfig()
    config.planning.experience.scope = "site"
    diagrams = [
        QuadpipsDiagram(robot, terrain, config),
        QuadpipsDiagram(robot, terrain, dataclasses.replace(config, region_source="oracle")),
        WalkDiagram(robot, terrain, [WalkCommand(0.0, "stance")], walk),
    ]
    config.tracking.mpc.ocp.sdf_clearance.enabled = True  # or nobody works out a distance
    diagrams.append(QuadpipsDiagram(robot, terrain, dataclasses.replace(config, region_source="elevation")))
    served = {id(stage.config) for diagram in diagrams for stage in stages_of(diagram)}
    idle = [key for tree in (config, walk) for key, section in sections(tree).items() if id(section) not in served]
    assert len(sections(config)) >= 13 and "velocity_reference" in sections(walk)
    assert not idle, f"no stage has the rate and the latency of {idle}"
