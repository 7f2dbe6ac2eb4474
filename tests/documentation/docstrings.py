"""Docstrings as mkdocstrings shall read them: ports as a table, and nothing that Markdown takes for HTML or links."""

import re

import griffe

from tests.documentation.hooks import PACKAGE
from tests.port_blocks import port_block_in, without_ports
from tests.systems_page import port_table

_CODE_OR_MARK = re.compile(r"(`+).+?\1|<(?=[a-zA-Z/!])|(?<=\])\[", re.DOTALL)
_PLAIN = {"<": "&lt;", "[": "&#91;"}


class HouseDocstrings(griffe.Extension):
    """Rewrites each docstring that is loaded, and puts the diagrams where Python finds them."""

    def on_object(self, *, obj: griffe.Object, **_) -> None:
        """Takes a module, class, function or attribute."""
        if obj.docstring:
            obj.docstring.value = as_markdown(obj.docstring.value)

    def on_package(self, *, pkg: griffe.Module, loader: griffe.GriffeLoader, **_) -> None:
        """Adds the package ``diagrams``, which lies beside ``pkg`` in the repository."""
        if pkg.name == PACKAGE:
            pkg.set_member("diagrams", loader.load("diagrams", try_relative_path=False))


def as_markdown(doc: str) -> str:
    """The docstring with a table of its ports, if it has a ``.. pydrake_system::`` block."""
    block = port_block_in(doc)
    text = _CODE_OR_MARK.sub(lambda found: _PLAIN.get(found.group(), found.group()), without_ports(doc).rstrip())
    return text if block is None else "\n".join([text, "", *port_table(block), ""])
