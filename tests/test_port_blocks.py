"""Every system documents its ports as Drake does, and the documentation agrees with what it declares."""

import importlib

import pytest
from pydrake.systems.framework import Diagram, LeafSystem

from tests.port_blocks import Port, agrees, problems, system_classes
from tests.source_tree import ROOT


def catalogued_systems() -> list:
    """Instances of every system, from the catalogues of the stages' tests."""
    catalogues = sorted((ROOT / "tests").glob("*/catalogue.py"))
    modules = [importlib.import_module(f"tests.{path.parent.name}.catalogue") for path in catalogues]
    return [system for module in modules for system in module.make_systems()]


@pytest.fixture(scope="module")
def systems() -> list:
    return catalogued_systems()


@pytest.mark.parametrize("base", [LeafSystem, Diagram])
def test_every_system_is_in_a_catalogue(systems, base):
    catalogued = {type(system) for system in systems}
    missing = [f"{cls.__module__}.{cls.__name__}" for cls in system_classes(base) if cls not in catalogued]
    assert not missing, f"add an instance to make_systems() in tests/<folder>/catalogue.py: {missing}"


def test_documented_ports_are_the_declared_ones(systems):
    found = [problem for system in systems for problem in problems(system)]
    assert not found, "\n".join(found)


class _Documented(LeafSystem):
    """Adds.

    .. pydrake_system::

        name: _Documented
        input_ports:
        - a
        - b (optional)
        output_ports:
        - sum

    - a, b: summands, which may take
      two lines.
    - sum: their sum.
    """

    def __init__(self, inputs, outputs):
        super().__init__()
        for name in inputs:
            self.DeclareVectorInputPort(name, 1)
        for name in outputs:
            self.DeclareVectorOutputPort(name, 1, lambda context, output: None)


def test_the_check_itself_finds_mistakes():
    assert problems(_Documented("ab", ["sum"])) == []
    assert problems(_Documented("a", ["sum"])) == [], "an optional port may be absent"
    assert "input_ports" in problems(_Documented("ba", ["sum"]))[0], "order counts"
    assert "output_ports" in problems(_Documented("a", ["total"]))[0]


class _Silent(LeafSystem):
    """Says nothing about its port.

    .. pydrake_system::

        name: _Silent
        input_ports:
        - a
    """

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("a", 1)


class _Talkative(LeafSystem):
    """Says things twice.

    .. pydrake_system::

        name: _Talkative
        input_ports:
        - a

    - a: number.
    - a: number.
    """

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("a", 1)


def test_every_port_is_described_once():
    assert problems(_Silent()) == ["_Silent: nothing is said about the input port 'a'"]
    assert problems(_Talkative()) == ["_Talkative: the port 'a' is described twice"]


def test_placeholders_stand_for_any_number_of_ports():
    listed = (Port("image", ""), Port("image_<camera>", ""), Port("pose_<camera>", ""), Port("state", ""))
    assert agrees(listed, ["image", "state"])
    assert agrees(listed, ["image", "image_left", "pose_left", "image_right", "pose_right", "state"])
    assert not agrees(listed, ["image_left", "pose_left", "state"])
    assert not agrees(listed, ["image", "state", "image_left"])
