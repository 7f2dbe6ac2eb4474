"""A diagram as a picture: its systems with their ports, and the wires between them, in the language of Graphviz's dot."""

from collections import Counter
from dataclasses import dataclass
from html import escape

from pydrake.systems.framework import Diagram, InputPortIndex, OutputPortIndex

_COLORS = ("#1b6ca8", "#b3541e", "#3d7a3d", "#7b3f9d", "#a8324a", "#4d4d4d", "#8a6d00", "#00757a")
"""Of the wires: all wires from one port have the same one, but those that leave the picture are grey."""
_ROOT = "s"
_TEXT = 'fontname="Helvetica"'
_FRAME, _TITLE, _BODY = "#9aa5b1", "#dfe7ef", "#ffffff"


@dataclass(frozen=True)
class PortEnd:
    """One end of a wire: a port of a part, or of the diagram itself."""

    part: int | None
    """Index of the part; None: the diagram's own port, seen from inside."""
    kind: str
    """input or output."""
    port: str


@dataclass(frozen=True)
class Block:
    """A system as it is drawn."""

    name: str
    kind: str
    """Name of its class."""
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    hidden: int = 0
    """Ports that are not drawn: those of Drake's own systems that nothing is connected to."""
    parts: tuple["Block", ...] = ()
    """What is inside; empty for a block that is drawn closed."""
    wires: tuple[tuple[PortEnd, PortEnd], ...] = ()
    """From where to where, between the parts and the diagram's own ports."""


def read_block(system, depth: int) -> Block:
    """Reads a system; ``depth`` is how many levels of subsystems it shows."""
    inputs = tuple(system.get_input_port(i).get_name() for i in range(system.num_input_ports()))
    outputs = tuple(system.get_output_port(i).get_name() for i in range(system.num_output_ports()))
    block = Block(system.get_name(), type(system).__name__, inputs, outputs)
    if depth == 0 or not isinstance(system, Diagram):
        return block
    parts = system.GetSystems()
    wires = _wires(system, {part: index for index, part in enumerate(parts)})
    blocks = [read_block(part, depth - 1) for part in parts]
    for index, part in enumerate(parts):
        if type(part).__module__.startswith("pydrake.") and not isinstance(part, Diagram):
            blocks[index] = _with_used_ports(blocks[index], index, wires)
    return Block(block.name, block.kind, inputs, outputs, 0, tuple(blocks), tuple(wires))


def _wires(diagram: Diagram, index_of: dict) -> list[tuple[PortEnd, PortEnd]]:
    """All wires of one level: exported inputs, connections (by source, for Drake's order is another each time), outputs."""
    wires = []
    for i in range(diagram.num_input_ports()):
        own = PortEnd(None, "input", diagram.get_input_port(i).get_name())
        for part, port in diagram.GetInputPortLocators(InputPortIndex(i)):
            wires.append((own, PortEnd(index_of[part], "input", part.get_input_port(int(port)).get_name())))

    def by_source(connection):
        (target, target_port), (source, source_port) = connection
        return index_of[source], int(source_port), index_of[target], int(target_port)

    for (target, target_port), (source, source_port) in sorted(diagram.connection_map().items(), key=by_source):
        start = PortEnd(index_of[source], "output", source.get_output_port(int(source_port)).get_name())
        wires.append((start, PortEnd(index_of[target], "input", target.get_input_port(int(target_port)).get_name())))
    for i in range(diagram.num_output_ports()):
        part, port = diagram.get_output_port_locator(OutputPortIndex(i))
        own = PortEnd(None, "output", diagram.get_output_port(i).get_name())
        wires.append((PortEnd(index_of[part], "output", part.get_output_port(int(port)).get_name()), own))
    return wires


def _with_used_ports(block: Block, index: int, wires) -> Block:
    """The block without the ports that no wire leads to."""
    used = {(end.kind, end.port) for wire in wires for end in wire if end.part == index}
    inputs = tuple(name for name in block.inputs if ("input", name) in used)
    outputs = tuple(name for name in block.outputs if ("output", name) in used)
    hidden = len(block.inputs) + len(block.outputs) - len(inputs) - len(outputs)
    return Block(block.name, block.kind, inputs, outputs, hidden, block.parts, block.wires)


def to_dot(block: Block) -> str:
    """Returns the graph of a block in dot's language."""
    lines = [
        "digraph {",
        f"graph [rankdir=LR, nodesep=0.25, ranksep=0.34, {_TEXT}, fontsize=15, pad=0.1, labelloc=t, labeljust=l]",
        f"node [shape=plain, {_TEXT}, fontsize=11]",
        "edge [arrowsize=0.7, penwidth=1.4]",
    ]
    _write(block, _ROOT, lines)
    return "\n".join([*lines, "}", ""])


def _write(block: Block, node: str, lines: list[str]) -> None:
    """Appends the nodes and edges of a block, whose own node is called ``node``."""
    if not block.parts:
        lines.append(f"{node} [label=<{_table(block)}>]")
        return
    lines.append(f"label=<<b>{escape(block.name)}</b>  {escape(block.kind)}>")
    for side, names in (("input", block.inputs), ("output", block.outputs)):
        if names:
            lines.append(f"{node}_{side} [label=<{_own_ports(names, side)}>]")
    for index, part in enumerate(block.parts):
        if part.parts:
            lines += [f"subgraph cluster_{node}_{index} {{", f'color="{_FRAME}"; style=rounded; margin=14']
        _write(part, f"{node}_{index}", lines)
        if part.parts:
            lines.append("}")
    _write_wires(block, node, lines)


def _write_wires(block: Block, node: str, lines: list[str]) -> None:
    """Appends the wires. One that leads back goes through a bend right of its start and a bend left of its end.

    Between the bends dot sees an edge that leads forward, for which it makes room beside the blocks; an edge that leads back
    would be drawn around the blocks' corners and over their titles.
    """
    place = {part: k for k, part in enumerate(_flow_order(block))}
    starts = list(dict.fromkeys(start for start, _ in block.wires))
    bends = set()
    for start, end in block.wires:
        number = starts.index(start)
        leaves = end.part is None and node == _ROOT
        color = f'color="{_FRAME if leaves else _COLORS[number % len(_COLORS)]}"'
        tail, head = _address(block, node, start, "e"), _address(block, node, end, "w")
        if None in (start.part, end.part) or place[start.part] < place[end.part]:
            lines.append(f"{tail} -> {head} [{color}]")
            continue
        right, left = f"{node}_from{number}", f"{node}_to{end.part}_{end.port}"
        point = f"[shape=point, width=0.05, {color}]"
        if right not in bends:
            lines += [f"{right} {point}", f"{tail} -> {right} [{color}, arrowhead=none, weight=4]"]
        lines += [f"{left} {point}", f"{left} -> {head} [{color}, weight=4]"]
        lines.append(f"{left} -> {right} [{color}, arrowhead=none]")
        bends.add(right)


def _flow_order(block: Block) -> list[int]:
    """The parts in the order of the data flow: few pairs and wires lead backward, the others not far; of orders with
    equally few such pairs one that begins with what was built first.

    Single parts are moved, from the order in which the diagram was built, as long as that makes it better.
    """
    pairs = Counter((start.part, end.part) for start, end in block.wires if None not in (start.part, end.part))

    def badness(order):
        place = {part: k for k, part in enumerate(order)}
        spans = {(start, end): place[end] - place[start] for start, end in pairs}
        backward = [pair for pair, span in spans.items() if span <= 0]
        length = sum(span for span in spans.values() if span > 0)
        return len(backward), order[0] != 0, sum(pairs[pair] for pair in backward), length

    best = list(range(len(block.parts)))
    while True:
        moved = [_moved(best, k, to) for k in range(len(best)) for to in range(len(best))]
        better = min(moved, key=badness, default=best)
        if badness(better) >= badness(best):
            return best
        best = better


def _moved(order: list[int], k: int, to: int) -> list[int]:
    rest = order[:k] + order[k + 1 :]
    return [*rest[:to], order[k], *rest[to:]]


def _address(block: Block, node: str, end: PortEnd, side: str) -> str:
    """Node, port and side at which a wire begins (e) or ends (w)."""
    if end.part is None:
        names = block.inputs if end.kind == "input" else block.outputs
        return f"{node}_{end.kind}:p{names.index(end.port)}:{side}"
    part = block.parts[end.part]
    names = part.inputs if end.kind == "input" else part.outputs
    index = names.index(end.port)
    if part.parts:
        return f"{node}_{end.part}_{end.kind}:p{index}:{side}"
    return f"{node}_{end.part}:{end.kind[0]}{index}:{side}"


def _table(block: Block) -> str:
    """A closed block: title, inputs to the left, outputs to the right."""
    rows = [
        f'<tr><td colspan="2" bgcolor="{_TITLE}"><b>{escape(block.name)}</b><br/>'
        f'<font point-size="9">{escape(block.kind)}</font></td></tr>'
    ]
    for i in range(max(len(block.inputs), len(block.outputs))):
        left = f'<td port="i{i}" align="left">{escape(block.inputs[i])}</td>' if i < len(block.inputs) else "<td></td>"
        right = f'<td port="o{i}" align="right">{escape(block.outputs[i])}</td>' if i < len(block.outputs) else "<td></td>"
        rows.append(f"<tr>{left}{right}</tr>")
    if block.hidden:
        rows.append(f'<tr><td colspan="2"><i>{block.hidden} more, not connected</i></td></tr>')
    return _framed("".join(rows))


def _own_ports(names: tuple[str, ...], side: str) -> str:
    """The ports of an open block."""
    rows = [f'<tr><td bgcolor="{_TITLE}"><b>{side}s</b></td></tr>']
    rows += [f'<tr><td port="p{i}">{escape(name)}</td></tr>' for i, name in enumerate(names)]
    return _framed("".join(rows))


def _framed(rows: str) -> str:
    return (
        f'<table border="1" cellborder="0" cellspacing="0" cellpadding="3" color="{_FRAME}" bgcolor="{_BODY}">{rows}</table>'
    )
