"""The ``.. pydrake_system::`` blocks in the docstrings of systems: what they list, what is said about each port."""

import re
import textwrap
from dataclasses import dataclass

import yaml
from pydrake.systems.framework import LeafSystem

from tests.source_tree import package_modules

_BLOCK = re.compile(r"^( *)\.\. pydrake_system::\n((?:\n|\1 +.*\n?)+)", re.MULTILINE)
_BULLET = re.compile(r"^- ((?:[^:\n]|\n(?!- ))+):((?:.|\n(?!- |\n))*)", re.MULTILINE)


@dataclass(frozen=True)
class Port:
    """One entry of a block."""

    name: str
    """May hold a placeholder: depth_image_<camera>."""
    remark: str
    """What stands behind the name in brackets, "optional" for instance."""

    @property
    def may_be_absent(self) -> bool:
        """Whether there are instances without it."""
        return self.remark == "optional" or "<" in self.name

    def pattern(self) -> str:
        """Regular expression of the names that it stands for."""
        return re.sub(r"<\w+>", r"[a-z0-9_]+", self.name)


@dataclass(frozen=True)
class PortBlock:
    """What the docstring of a system says about its ports."""

    name: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    texts: dict
    """(name of a port, "input" or "output") -> what is said about it, in one line."""
    twice: tuple[str, ...] = ()
    """Ports that are described more than once."""


def system_classes(base: type = LeafSystem) -> list[type]:
    """Every LeafSystem (or Diagram) that is defined in the package, by module and name; framework/ holds only bases."""
    found = {
        member
        for module in package_modules()
        for member in vars(module).values()
        if isinstance(member, type)
        and issubclass(member, base)
        and member.__module__ == module.__name__
        and not module.__name__.startswith("quadpips_drake.framework.")
    }
    return sorted(found, key=lambda cls: (cls.__module__, cls.__name__))


def plain_docstring(cls: type) -> str:
    """The docstring without the indentation of the class."""
    return textwrap.dedent(" " * 4 + (cls.__doc__ or ""))


def port_block(cls: type) -> PortBlock | None:
    """Returns what the docstring of ``cls`` says, or None if there is no block in it."""
    return port_block_in(plain_docstring(cls))


def port_block_in(doc: str) -> PortBlock | None:
    """Returns what a plain docstring says, or None if there is no block in it."""
    match = _BLOCK.search(doc)
    if match is None:
        return None
    block = yaml.safe_load(textwrap.dedent(match.group(2)))
    ports = {kind: tuple(_port(entry) for entry in block.get(f"{kind}_ports") or ()) for kind in ("input", "output")}
    texts, twice = {}, []
    for subject, text in _BULLET.findall(doc[match.end() :]):
        line = " ".join(text.split())
        for name, remark in re.findall(r"([\w<>]+)(?: \((\w+)\))?", " ".join(subject.split())):
            for kind in [remark] if remark in ports else ports:
                twice += [name] if (name, kind) in texts else []
                texts[name, kind] = line
    return PortBlock(block.get("name"), ports["input"], ports["output"], texts, tuple(twice))


def without_ports(doc: str) -> str:
    """A plain docstring without its block and the list of ports below it."""
    match = _BLOCK.search(doc)
    return doc if match is None else doc[: match.start()] + _BULLET.sub("", doc[match.end() :])


def _port(entry: str) -> Port:
    name, _, remark = entry.partition(" (")
    return Port(name, remark.removesuffix(")"))


def agrees(listed: tuple[Port, ...], declared: list[str]) -> bool:
    """Whether the names of ports that an instance declares are, in order, those that are listed.

    Ports that may be absent need not be there; neighbours with a placeholder may be there several times, in turn.
    """
    pattern, i = "", 0
    while i < len(listed):
        group = [listed[i]]
        while "<" in listed[i].name and i + len(group) < len(listed) and "<" in listed[i + len(group)].name:
            group.append(listed[i + len(group)])
        parts = "".join(f"(?:{port.pattern()},){'?' if port.may_be_absent else ''}" for port in group)
        pattern += f"(?:{parts})*?" if "<" in group[0].name else parts
        i += len(group)
    return re.fullmatch(pattern, "".join(f"{name}," for name in declared)) is not None


def problems(system) -> list[str]:
    """What is wrong with the documentation of a system's ports."""
    cls = type(system)
    block = port_block(cls)
    if block is None:
        return [f"{cls.__name__}: no '.. pydrake_system::' block in its docstring"]
    found = [] if block.name == cls.__name__ else [f"{cls.__name__}: the block names it {block.name}"]
    found += [f"{cls.__name__}: the port '{name}' is described twice" for name in dict.fromkeys(block.twice)]
    declared = {
        "input": [system.get_input_port(i).get_name() for i in range(system.num_input_ports())],
        "output": [system.get_output_port(i).get_name() for i in range(system.num_output_ports())],
    }
    for kind, listed in (("input", block.inputs), ("output", block.outputs)):
        if not agrees(listed, declared[kind]):
            names = [port.name for port in listed]
            found.append(f"{cls.__name__}: {kind}_ports documented as {names}, declared as {declared[kind]}")
        silent = [port.name for port in listed if (port.name, kind) not in block.texts]
        found += [f"{cls.__name__}: nothing is said about the {kind} port '{name}'" for name in silent]
    return found
