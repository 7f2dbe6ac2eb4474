"""Abstract ports that know the type of their values, and a DiagramBuilder that refuses to join unlike ones.

To Drake every Python object is of one type, so that a torso path could be wired into an input for the robot's state and only
come to light as an AttributeError somewhere in a simulation. Here a port is declared with its type, by way of an example
value; whoever wires a diagram with this ``DiagramBuilder`` is told about unlike ends at once, with both names.
"""

from collections.abc import Callable

from pydrake.common.value import AbstractValue
from pydrake.systems import framework
from pydrake.systems.framework import InputPort, LeafSystem, OutputPort, PortDataType, System


class WiringError(TypeError):
    """Two ports were to be joined, or a port was fed, whose values are of different types."""


def example_of(kind: type):
    """Returns the example value of the type ``kind``: ``kind.empty()`` if it has that, else what its constructor makes."""
    return kind.empty() if hasattr(kind, "empty") else kind()


def declare_input(system: LeafSystem, name: str, kind: type, *, example=None) -> InputPort:
    """Declares the abstract input port ``name`` of ``system`` for values of type ``kind``.

    Args:
        system: the owner.
        name: of the port.
        kind: type of the values.
        example: a value of that type, where ``example_of(kind)`` is none.
    """
    return system.DeclareAbstractInputPort(name, AbstractValue.Make(example_of(kind) if example is None else example))


def declare_output(
    system: LeafSystem, name: str, kind: type, calc: Callable, prerequisites: set | None = None, *, example=None
) -> OutputPort:
    """Declares the abstract output port ``name`` of ``system`` for values of type ``kind``.

    Args:
        system: the owner.
        name: of the port.
        kind: type of the values.
        calc: ``calc(context)`` returns the value.
        prerequisites: tickets of what ``calc`` looks at; None: everything.
        example: a value of that type, where ``example_of(kind)`` is none.
    """
    value = example_of(kind) if example is None else example

    def write(context, output):
        output.set_value(calc(context))

    more = () if prerequisites is None else (prerequisites,)
    return system.DeclareAbstractOutputPort(name, lambda: AbstractValue.Make(value), write, *more)


def value_type(port: InputPort | OutputPort) -> type | None:
    """The type of the values of an abstract port (of a leaf system or a diagram); None for a port of vectors."""
    if port.get_data_type() != PortDataType.kAbstractValued:
        return None
    try:
        return type(port.Allocate().get_value())
    except RuntimeError:  # a C++ type without a Python name, of a port of Drake's own
        return None


def full_name(port: InputPort | OutputPort) -> str:
    """'system.port', for messages."""
    system = port.get_system()
    return f"{system.get_name() or type(system).__name__}.{port.get_name()}"


def check_connection(source: OutputPort, target: InputPort) -> None:
    """Raises WiringError unless values of ``source`` may be given to ``target``."""
    given, wanted = value_type(source), value_type(target)
    # Drake itself compares the types of its own, C++, values; what remains is Python's.
    if given is not None and wanted is not None and not issubclass(given, wanted):
        raise WiringError(
            f"the output {full_name(source)} carries {given.__name__}, which cannot be wired to the input "
            f"{full_name(target)}: it takes {wanted.__name__}"
        )


def connect_by_name(builder: framework.DiagramBuilder, system: System, sources: dict[str, OutputPort]) -> None:
    """Connects each input port of ``system`` to the source of the same name.

    Inputs that ``system.optional_inputs`` names may remain without a source.

    Raises:
        WiringError: nothing feeds an input, or a source carries values of another type.
    """
    optional = getattr(system, "optional_inputs", ())
    for index in range(system.num_input_ports()):
        port = system.get_input_port(index)
        name = port.get_name()
        if name in sources:
            builder.Connect(sources[name], port)
        elif name not in optional:
            raise WiringError(f"nothing feeds the input {full_name(port)}; there are: {', '.join(sorted(sources))}")


def input_names(system: System) -> list[str]:
    """Names of all input ports of ``system``."""
    return [system.get_input_port(index).get_name() for index in range(system.num_input_ports())]


def output_names(system: System) -> list[str]:
    """Names of all output ports of ``system``."""
    return [system.get_output_port(index).get_name() for index in range(system.num_output_ports())]


def output_of(system: System, name: str, kind: type) -> OutputPort:
    """Returns the output port ``name`` of ``system``.

    Raises:
        WiringError: there is none, or its values are not of type ``kind``.
    """
    who = system.get_name() or type(system).__name__
    if not system.HasOutputPort(name):
        raise WiringError(f"{who} has no output port '{name}' ({kind.__name__})")
    port = system.GetOutputPort(name)
    found = value_type(port)
    if found is None or not issubclass(found, kind):
        raise WiringError(
            f"the output {full_name(port)} must carry {kind.__name__}, not {found.__name__ if found else 'a vector'}"
        )
    return port


class DiagramBuilder(framework.DiagramBuilder):
    """Drake's DiagramBuilder, which also compares the types of Python values when ports are joined."""

    __slots__ = ()  # see systems.py: builder and diagram refer to each other

    def __init__(self):
        super().__init__()
        self._exported_inputs: dict[str | int, tuple[str, type | None]] = {}
        """Name and type of values of the port to which each leads; ports themselves may keep their system alive."""

    def Connect(self, source: OutputPort, target: InputPort) -> None:
        """As in Drake.

        Raises:
            WiringError: the ports' values are of different types; the message names both.
        """
        check_connection(source, target)
        super().Connect(source, target)

    def ExportInput(self, input: InputPort, name: str | framework.UseDefaultName = framework.kUseDefaultName):
        """As in Drake."""
        index = super().ExportInput(input, name)
        self._exported_inputs[int(index)] = self._exported_inputs[name] = full_name(input), value_type(input)
        return index

    def ConnectInput(self, diagram_port: str | framework.InputPortIndex, input: InputPort) -> None:
        """As in Drake.

        Raises:
            WiringError: ``input`` takes other values than the input to which the diagram's port led first. They must be of
                the same type, not only fit: Drake has the diagram's port stand for any one of those that it leads to.
        """
        key = diagram_port if isinstance(diagram_port, str) else int(diagram_port)
        first, wanted = self._exported_inputs.get(key, (None, None))
        if first is not None and wanted is not value_type(input):
            types = [getattr(kind, "__name__", "a vector") for kind in (wanted, value_type(input))]
            raise WiringError(
                f"one input of the diagram cannot lead to both {first}, which takes {types[0]}, and "
                f"{full_name(input)}, which takes {types[1]}"
            )
        super().ConnectInput(diagram_port, input)
