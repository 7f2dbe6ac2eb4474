"""Pictures of diagrams: all ports that there are and no others, wires that keep off the blocks."""

import re
from html import unescape
from xml.etree import ElementTree

import numpy as np
import pytest
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import Adder, Multiplexer, ZeroOrderHold

from quadpips_drake.cli.diagram import build_diagram
from quadpips_drake.visualization.diagram_graph import read_block, to_dot
from tests.source_tree import ROOT

PICTURE = ROOT / "docs" / "images" / "quadpips.svg"
REGENERATE = "quadpips diagram quadpips --out docs/images/quadpips.svg"
SVG = "{http://www.w3.org/2000/svg}"
MAX_WIDTH = 1600
"""Of the picture in the README [pixels]."""
POINT = 4 / 3
"""[pixels]"""


def port_names(system, kind: str) -> list[str]:
    """Names of all inputs or outputs of a system."""
    count, get = (
        (system.num_input_ports, system.get_input_port)
        if kind == "input"
        else (system.num_output_ports, system.get_output_port)
    )
    return [get(i).get_name() for i in range(count())]


def drawn_ports(graph: str, node: str) -> tuple[list[str], list[str]]:
    """Inputs and outputs in the table of a closed block."""
    (label,) = re.findall(rf"^{node} \[label=<(.*)>\]$", graph, re.MULTILINE)
    return tuple([unescape(n) for n in re.findall(rf'port="{side}\d+"[^>]*>([^<]*)<', label)] for side in "io")


@pytest.fixture(scope="module")
def quadpips():
    return build_diagram("quadpips", "anymal_c", "flat")


@pytest.mark.parametrize("name", ["quadpips", "station", "perception", "planning", "tracking"])
def test_all_ports_are_drawn_and_no_others(name, quadpips):
    diagram = quadpips if name == "quadpips" else quadpips.GetSubsystemByName(name)
    block = read_block(diagram, 1)
    graph = to_dot(block)
    for index, (system, part) in enumerate(zip(diagram.GetSystems(), block.parts, strict=True)):
        drawn = drawn_ports(graph, f"s_{index}")
        declared = port_names(system, "input"), port_names(system, "output")
        assert part.name == system.get_name() and part.kind == type(system).__name__
        if type(system).__module__.startswith("pydrake."):
            assert all(set(few) <= set(many) for few, many in zip(drawn, declared, strict=True))
            assert len(drawn[0]) + len(drawn[1]) + part.hidden == len(declared[0]) + len(declared[1])
        else:
            assert drawn == declared
    own = {side: re.findall(rf"^s_{side} \[label=<(.*)>\]$", graph, re.MULTILINE) for side in ("input", "output")}
    for side, labels in own.items():
        assert re.findall(r'port="p\d+">([^<]*)<', "".join(labels)) == port_names(diagram, side)


def loop() -> Diagram:
    """A hold whose output comes back to an adder in front of it; one input and one output outside."""
    builder = DiagramBuilder()
    hold = builder.AddNamedSystem("hold", ZeroOrderHold(0.1, 1))
    adder = builder.AddNamedSystem("adder", Adder(2, 1))
    builder.AddNamedSystem("loose", Multiplexer(3))
    builder.Connect(adder.get_output_port(), hold.get_input_port())
    builder.Connect(hold.get_output_port(), adder.get_input_port(0))
    builder.ExportInput(adder.get_input_port(1), "a")
    builder.ExportOutput(hold.get_output_port(), "b")
    diagram = builder.Build()
    diagram.set_name("loop")
    return diagram


def test_wires_are_those_of_the_diagram():
    block = read_block(loop(), 1)
    (into,), (out_of,) = block.parts[0].inputs, block.parts[0].outputs
    ends = {(start.part, start.port, end.part, end.port) for start, end in block.wires}
    assert ends == {(1, "sum", 0, into), (0, out_of, 1, "u0"), (None, "a", 1, "u1"), (0, out_of, None, "b")}
    assert block.parts[2].hidden == 4 and block.parts[2].inputs == ()


def test_a_wire_that_leads_back_is_bent():
    graph = to_dot(read_block(loop(), 1))
    forward = re.findall(r"^s_(\d+):o\d+:e -> s_(\d+):i\d+:w ", graph, re.MULTILINE)
    assert len(forward) == 1, "one of the two wires of the loop leads forward"
    assert len(re.findall(r"shape=point", graph)) == 2, "the other has two bends"


def test_the_same_diagram_gives_the_same_graph():
    assert len({to_dot(read_block(loop(), 1)) for _ in range(5)}) == 1


def test_levels():
    inner = loop()
    builder = DiagramBuilder()
    builder.AddSystem(inner)
    outer = builder.Build()
    assert read_block(outer, 0).parts == ()
    assert [part.name for part in read_block(outer, 1).parts] == ["loop"]
    assert len(read_block(outer, 2).parts[0].parts) == 3
    assert "cluster_s_0" in to_dot(read_block(outer, 2)) and "cluster" not in to_dot(read_block(outer, 1))


def picture_nodes() -> dict[str, tuple[list[str], np.ndarray]]:
    """Name of each block in the README's picture -> its other texts, and its corners (2, 2)."""
    nodes = {}
    for group in ElementTree.parse(PICTURE).getroot().iter(f"{SVG}g"):
        texts = ["".join(text.itertext()) for text in group.findall(f"{SVG}text")]
        if group.get("class") == "node" and texts:
            points = " ".join(polygon.get("points") for polygon in group.findall(f"{SVG}polygon"))
            corners = np.array(re.findall(r"-?[\d.]+", points), dtype=float).reshape(-1, 2)
            nodes[texts[0]] = texts[1:], np.array([corners.min(axis=0), corners.max(axis=0)])
    return nodes


def picture_wires() -> list[np.ndarray]:
    """Points along each wire of the picture, (n, 2)."""
    wires, t = [], np.linspace(0.0, 1.0, 25)[:, None]
    for group in ElementTree.parse(PICTURE).getroot().iter(f"{SVG}g"):
        if group.get("class") == "edge":
            p = np.array(re.findall(r"-?[\d.]+", group.find(f"{SVG}path").get("d")), dtype=float).reshape(-1, 2)
            pieces = [
                (1 - t) ** 3 * p[i] + 3 * t * (1 - t) ** 2 * p[i + 1] + 3 * t**2 * (1 - t) * p[i + 2] + t**3 * p[i + 3]
                for i in range(0, len(p) - 1, 3)
            ]
            wires.append(np.concatenate(pieces))
    return wires


def test_the_picture_in_the_readme_is_up_to_date(quadpips):
    drawn = {name: sorted(texts) for name, (texts, _) in picture_nodes().items()}
    block = read_block(quadpips, 1)
    expected = {
        part.name: sorted([part.kind, *part.inputs, *part.outputs, *([f"{part.hidden} more"] if part.hidden else [])])
        for part in block.parts
    }
    expected |= {side: sorted(names) for side, names in (("inputs", block.inputs), ("outputs", block.outputs)) if names}
    assert drawn == expected, f"run: {REGENERATE}"


def test_the_picture_in_the_readme_is_readable():
    width = float(re.match(r"[\d.]+", ElementTree.parse(PICTURE).getroot().get("width")).group())
    assert width * POINT <= MAX_WIDTH
    wires = picture_wires()
    assert wires
    for name, (_, (low, high)) in picture_nodes().items():
        for wire in wires:
            inside = ((wire > low + 3.0) & (wire < high - 3.0)).all(axis=1)
            assert not inside.any(), f"a wire crosses {name}"
