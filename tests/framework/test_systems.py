"""Systems in Python go when nobody needs them any more."""

import gc
import weakref

import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems import framework
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import EventStatus

from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.framework.systems import Diagram, LeafSystem
from tests.test_port_blocks import catalogued_systems


class Counter(LeafSystem):
    """All that refers to the system itself: ports, functions of ports and events, a cache entry."""

    def __init__(self):
        super().__init__()
        self.input = self.DeclareVectorInputPort("step", 1)
        self.state = self.DeclareDiscreteState(1)
        self.entry = self.declare_cache_entry(
            "twice",
            lambda: AbstractValue.Make(0.0),
            lambda context, value: value.set_value(2.0 * self.count(context)),
            {self.all_state_ticket()},
        )
        self.output = self.DeclareVectorOutputPort("count", 1, self.write_vector, {self.all_state_ticket()})
        self.DeclareAbstractOutputPort(
            "text", lambda: AbstractValue.Make(""), lambda context, output: output.set_value(self.text(context))
        )
        self.DeclareInitializationPublishEvent(self.look)
        self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.1, self.add)
        self.DeclarePeriodicPublishEvent(0.1, 0.0, lambda context: self.look(context))

    def count(self, context):
        return context.get_discrete_state(self.state)[0]

    def text(self, context):
        return f"{self.count(context):g} {self.get_cache_entry(self.entry).Eval(context):g}"

    def write_vector(self, context, output):
        output.SetFromVector([self.count(context)])

    def add(self, context, state):
        state.set_value(self.state, [self.count(context) + self.input.Eval(context)[0]])
        return EventStatus.Succeeded()

    def look(self, context):
        return EventStatus.Succeeded()


class Box(Diagram):
    """A diagram that holds its parts as attributes, too."""

    def __init__(self):
        super().__init__()
        builder = DiagramBuilder()
        self.first, self.second = builder.AddSystem(Counter()), builder.AddSystem(Counter())
        builder.Connect(self.first.output, self.second.input)
        builder.ExportInput(self.first.input, "step")
        builder.ExportOutput(self.second.GetOutputPort("text"), "text")
        builder.BuildInto(self)
        self.itself = self


def simulate_box():
    """Returns the parts of a simulated diagram, and what it came to."""
    box = Box()
    simulator = Simulator(box)
    context = simulator.get_mutable_context()
    box.GetInputPort("step").FixValue(context, [1.0])
    simulator.AdvanceTo(0.35)
    return [box, box.first, box.second, simulator], box.GetOutputPort("text").Eval(context)


def test_a_simulated_diagram_goes_with_all_its_parts():
    parts, text = simulate_box()
    assert text == "3 6"  # at 0.1, 0.2, 0.3 the first adds 1, the second what the first had before: 0 + 1 + 2
    references = [weakref.ref(part) for part in parts]
    del parts
    gc.collect()
    assert [reference() for reference in references] == [None] * 4


def test_functions_live_as_long_as_the_system():
    counter = Counter()
    gc.collect()
    context = counter.CreateDefaultContext()
    assert counter.GetOutputPort("text").Eval(context) == "0 0"


@pytest.mark.parametrize("base", [LeafSystem, Diagram])
def test_classes_take_attributes_and_have_no_dict_of_their_own(base):
    class Other(base):
        pass

    other = Other() if base is LeafSystem else None
    assert Other.__dictoffset__ == 0 and issubclass(Other, getattr(framework, base.__name__))
    if other is not None:
        other.anything = other
        assert other.anything is other


def test_every_system_of_ours_goes():
    systems = catalogued_systems()
    references = [(type(system).__name__, weakref.ref(system)) for system in systems]
    assert len(references) > 20
    del systems
    gc.collect()
    assert [name for name, reference in references if reference() is not None] == []
