"""Every LeafSystem documents its ports as Drake does, and the documentation agrees with what it declares."""

import importlib
import re
import textwrap

import yaml
from pydrake.systems.framework import LeafSystem

from quadpips_drake.framework.stage import Stage
from tests.source_tree import ROOT, package_modules

OPTIONAL = " (optional)"


def system_classes() -> set[type]:
    """Every LeafSystem that is defined in the package; the base of all stages is none by itself."""
    return {
        member
        for module in package_modules()
        for member in vars(module).values()
        if isinstance(member, type)
        and issubclass(member, LeafSystem)
        and member.__module__ == module.__name__
        and member is not Stage
    }


def catalogued_systems() -> list[LeafSystem]:
    """One instance of each system, from the catalogues of the stages' tests."""
    catalogues = sorted((ROOT / "tests").glob("*/catalogue.py"))
    modules = [importlib.import_module(f"tests.{path.parent.name}.catalogue") for path in catalogues]
    return [system for module in modules for system in module.make_systems()]


def port_block(cls: type) -> dict | None:
    """Returns the YAML of the ``.. pydrake_system::`` block in the docstring, or None if there is none."""
    doc = textwrap.dedent(" " * 4 + (cls.__doc__ or ""))
    match = re.search(r"^( *)\.\. pydrake_system::\n((?:\n|\1 +.*\n?)+)", doc, re.MULTILINE)
    return yaml.safe_load(textwrap.dedent(match.group(2))) if match else None


def problems(system: LeafSystem) -> list[str]:
    """What is wrong with the documentation of a system's ports."""
    cls = type(system)
    block = port_block(cls)
    if block is None:
        return [f"{cls.__name__}: no '.. pydrake_system::' block in its docstring"]
    found = []
    if block.get("name") != cls.__name__:
        found.append(f"{cls.__name__}: the block names it {block.get('name')}")
    prose = (
        cls.__doc__[: cls.__doc__.index(".. pydrake_system::")]
        + re.split(r"output_ports:\n(?: *-.*\n)*|output_ports: \[\]\n", cls.__doc__, maxsplit=1)[-1]
    )
    for kind, declared in (
        ("input_ports", [system.get_input_port(i).get_name() for i in range(system.num_input_ports())]),
        ("output_ports", [system.get_output_port(i).get_name() for i in range(system.num_output_ports())]),
    ):
        listed = block.get(kind) or []
        names = [name.removesuffix(OPTIONAL) for name in listed]
        # An optional port need not be there in this instance.
        expected = [n for n, entry in zip(names, listed, strict=True) if n in declared or not entry.endswith(OPTIONAL)]
        if declared != expected:
            found.append(f"{cls.__name__}: {kind} documented as {names}, declared as {declared}")
        found += [f"{cls.__name__}: nothing is said about the port '{n}'" for n in names if n not in prose]
    return found


def test_every_system_is_in_a_catalogue():
    catalogued = {type(system) for system in catalogued_systems()}
    missing = sorted(f"{cls.__module__}.{cls.__name__}" for cls in system_classes() - catalogued)
    assert not missing, f"add an instance to make_systems() in tests/<stage>/catalogue.py: {missing}"


def test_documented_ports_are_the_declared_ones():
    found = [problem for system in catalogued_systems() for problem in problems(system)]
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

    ``a`` and ``b``: summands. ``sum``: their sum.
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
