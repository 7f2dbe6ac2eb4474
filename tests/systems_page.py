"""Writes docs/systems.md, the index of all systems and their ports, from the docstrings: python -m tests.systems_page"""

import re

from pydrake.systems.framework import Diagram, LeafSystem

from tests.port_blocks import PortBlock, plain_docstring, port_block, system_classes
from tests.source_tree import ROOT
from tests.test_house_rules import ABOVE_THE_STAGES, STAGES

PAGE = ROOT / "docs" / "systems.md"
_HEAD = """# Systems and their ports

Every system of the package, written from the docstrings by `python -m tests.systems_page`; tests hold this page against
them, and the docstrings against the ports that are declared. An optional port may stay unconnected, or is there only if
the configuration asks for it.

"""


def make_page() -> str:
    """Returns the text of the page."""
    classes = [*system_classes(Diagram), *system_classes(LeafSystem)]
    parts = sorted({_part(cls) for cls in classes}, key=lambda part: [*STAGES, *ABOVE_THE_STAGES].index(part))
    sections = {part: [cls for cls in classes if _part(cls) == part] for part in ["diagrams", *parts[:-1]]}
    lines = ["| folder | systems |", "|---|---|"]
    for part, members in sections.items():
        lines.append(f"| `{part}` | {', '.join(f'[{cls.__name__}](#{cls.__name__.lower()})' for cls in members)} |")
    for part, members in sections.items():
        lines += ["", f"## {part}"]
        for cls in members:
            lines += ["", *_entry(cls)]
    return _HEAD + "\n".join(lines) + "\n"


def _part(cls: type) -> str:
    return cls.__module__.split(".")[1]


def _entry(cls: type) -> list[str]:
    """The lines about one system."""
    path = cls.__module__.replace(".", "/") + ".py"
    path = path.removeprefix("quadpips_drake/") if _part(cls) == "diagrams" else path
    first = plain_docstring(cls).split("\n\n")[0]
    lines = [f"### {cls.__name__}", "", f"`{path}`. {_inline(first)}"]
    table = port_table(port_block(cls))
    return [*lines, "", *table] if table else lines


def port_table(block: PortBlock) -> list[str]:
    """The lines of a table of all ports; empty where there are none."""
    rows = [*_rows(block, "input"), *_rows(block, "output")]
    return ["| | port | |", "|---|---|---|", *rows] if rows else []


def _rows(block: PortBlock, kind: str) -> list[str]:
    ports = block.inputs if kind == "input" else block.outputs
    word = {"input": "in", "output": "out"}[kind]
    remarks = [f" ({port.remark})" if port.remark else "" for port in ports]
    return [
        f"| {word} | `{port.name}`{remark} | {_inline(block.texts[port.name, kind])} |"
        for port, remark in zip(ports, remarks, strict=True)
    ]


def _inline(text: str) -> str:
    """Text of a docstring on one line of Markdown."""
    text = " ".join(text.split()).replace("``", "`").replace("|", r"\|")
    return re.sub(r"<(\w+)>", r"&lt;\1&gt;", text).replace("*", r"\*")


if __name__ == "__main__":
    PAGE.write_text(make_page(), encoding="utf-8")
    print(f"wrote {PAGE}")
