"""Unlike ports are not joined: neither when a diagram is built nor, wired behind our back, when it runs."""

from dataclasses import dataclass

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import ContactResults, MultibodyPlant
from pydrake.systems import framework
from pydrake.systems.framework import LeafSystem
from pydrake.systems.primitives import ConstantValueSource, ConstantVectorSource

from quadpips_drake.framework.ports import (
    DiagramBuilder,
    WiringError,
    check_connection,
    declare_input,
    declare_output,
    full_name,
    value_type,
)
from quadpips_drake.framework.stage import Stage
from quadpips_drake.framework.stage_config import OnDemandStageConfig
from quadpips_drake.planning.footholds.foothold_planner_system import FootholdPlanner
from quadpips_drake.planning.torso.torso_planner_system import TorsoPlanner
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.immutable import ImmutableValue

ROBOT = load_robot("anymal_c")


@dataclass(frozen=True, eq=False)
class Fruit(ImmutableValue):
    """A value with an empty() of its own."""

    weight: float

    @staticmethod
    def empty():
        return Fruit(0.0)


class Apple(Fruit):
    """More than a fruit."""

    @staticmethod
    def empty():
        return Apple(1.0)


class Stone:
    """A value without empty()."""


class Tree(LeafSystem):
    """Puts out a value of a type."""

    def __init__(self, kind):
        super().__init__()
        self.set_name("tree")
        declare_output(self, "yield", kind, lambda context: kind())


class Basket(LeafSystem):
    """Takes values of a type, and vectors of three numbers."""

    def __init__(self, kind, name="basket"):
        super().__init__()
        self.set_name(name)
        declare_input(self, "content", kind)
        self.DeclareVectorInputPort("place", 3)


class Scales(Stage):
    """Weighs a fruit."""

    def __init__(self):
        super().__init__("scales", OnDemandStageConfig(), memory=0.0)
        self.declare_input("content", Fruit)
        self.declare_output("weight", float)

    def update(self, inputs, memory, time):
        return inputs.content.weight


def test_ports_know_the_type_of_their_values():
    basket = Basket(Fruit)
    assert value_type(basket.GetInputPort("content")) is Fruit
    assert value_type(basket.GetInputPort("place")) is None
    assert value_type(Tree(Apple).GetOutputPort("yield")) is Apple
    assert value_type(Tree(Stone).GetOutputPort("yield")) is Stone
    assert full_name(basket.GetInputPort("content")) == "basket.content"
    basket.set_name("")
    assert full_name(basket.GetInputPort("content")) == "Basket.content"


def test_a_torso_path_is_not_the_robots_state():
    builder = DiagramBuilder()
    torso, footholds = builder.AddSystem(TorsoPlanner(ROBOT)), builder.AddSystem(FootholdPlanner(ROBOT))
    builder.Connect(torso.GetOutputPort("torso_path"), footholds.GetInputPort("torso_path"))
    with pytest.raises(WiringError) as error:
        builder.Connect(torso.GetOutputPort("torso_path"), footholds.GetInputPort("robot_state"))
    assert str(error.value) == (
        "the output torso_planner.torso_path carries TorsoPath, which cannot be wired to the input "
        "foothold_planner.robot_state: it takes RobotState"
    )


def test_more_than_was_asked_for_is_taken_and_less_is_not():
    check_connection(Tree(Apple).GetOutputPort("yield"), Basket(Fruit).GetInputPort("content"))
    with pytest.raises(WiringError, match=r"tree\.yield carries Fruit.*basket\.content: it takes Apple"):
        check_connection(Tree(Fruit).GetOutputPort("yield"), Basket(Apple).GetInputPort("content"))


def test_vectors_and_values_are_not_joined():
    builder = DiagramBuilder()
    basket = builder.AddSystem(Basket(Fruit))
    three, four = builder.AddSystem(ConstantVectorSource(np.zeros(3))), builder.AddSystem(ConstantVectorSource(np.zeros(4)))
    builder.Connect(three.get_output_port(), basket.GetInputPort("place"))
    # Vectors are Drake's own affair.
    with pytest.raises(RuntimeError, match="content"):
        builder.Connect(three.get_output_port(), basket.GetInputPort("content"))
    other = builder.AddSystem(Basket(Fruit, "other"))
    with pytest.raises(RuntimeError, match="place"):
        builder.Connect(four.get_output_port(), other.GetInputPort("place"))


def test_drakes_own_types_have_a_name_too():
    plant = MultibodyPlant(time_step=1e-3)
    plant.Finalize()
    contacts = plant.get_contact_results_output_port()
    assert value_type(contacts) is ContactResults
    with pytest.raises(WiringError, match=r"contact_results carries ContactResults.*basket\.content: it takes Fruit"):
        check_connection(contacts, Basket(Fruit).GetInputPort("content"))


@pytest.mark.parametrize("by_name", [True, False])
def test_an_exported_input_leads_to_inputs_of_one_type(by_name):
    builder = DiagramBuilder()
    first, second = builder.AddSystem(Basket(Fruit, "first")), builder.AddSystem(Basket(Fruit, "second"))
    apples = builder.AddSystem(Basket(Apple, "apples"))
    index = builder.ExportInput(first.GetInputPort("content"), "harvest")
    port = "harvest" if by_name else index
    builder.ConnectInput(port, second.GetInputPort("content"))
    for unlike, kind in (("content", "Apple"), ("place", "a vector")):
        with pytest.raises(WiringError, match=rf"both first\.content.* Fruit, and apples\.{unlike}.* {kind}"):
            builder.ConnectInput(port, apples.GetInputPort(unlike))
    builder.ExportInput(first.GetInputPort("place"), "place")
    builder.ConnectInput("place", second.GetInputPort("place"))
    assert value_type(builder.Build().GetInputPort("harvest")) is Fruit


def test_an_exported_input_may_go_without_a_name():
    builder = DiagramBuilder()
    fruits, stones = builder.AddSystem(Basket(Fruit, "fruits")), builder.AddSystem(Basket(Stone, "stones"))
    index = builder.ExportInput(fruits.GetInputPort("content"))
    with pytest.raises(WiringError, match="stones"):
        builder.ConnectInput(index, stones.GetInputPort("content"))
    assert builder.Build().get_input_port().get_name() == "fruits_content"


def test_ports_of_diagrams_are_typed_like_those_behind_them():
    inner = DiagramBuilder()
    basket, tree = inner.AddSystem(Basket(Fruit)), inner.AddSystem(Tree(Stone))
    inner.ExportInput(basket.GetInputPort("content"), "content")
    inner.ExportOutput(tree.GetOutputPort("yield"), "yield")
    diagram = inner.Build()
    diagram.set_name("orchard")
    outer = DiagramBuilder()
    outer.AddSystem(diagram)
    apples, other = outer.AddSystem(Tree(Apple)), outer.AddSystem(Basket(Fruit, "other"))
    with pytest.raises(WiringError, match=r"orchard\.yield carries Stone.*other\.content"):
        outer.Connect(diagram.GetOutputPort("yield"), other.GetInputPort("content"))
    with pytest.raises(WiringError, match=r"orchard\.yield carries Stone.*orchard\.content"):
        outer.Connect(diagram.GetOutputPort("yield"), diagram.GetInputPort("content"))
    outer.Connect(apples.GetOutputPort("yield"), diagram.GetInputPort("content"))


def _scales_fed_by_drake(value):
    """A diagram that pydrake's own builder has wired, which compares nothing, and the port to read."""
    builder = framework.DiagramBuilder()
    source = builder.AddSystem(ConstantValueSource(AbstractValue.Make(value)))
    scales = builder.AddSystem(Scales())
    builder.Connect(source.get_output_port(), scales.GetInputPort("content"))
    builder.ExportOutput(scales.GetOutputPort("weight"), "weight")
    return builder.Build()


def test_what_others_have_wired_is_found_out_when_it_is_read():
    diagram = _scales_fed_by_drake(Apple(2.0))
    assert diagram.GetOutputPort("weight").Eval(diagram.CreateDefaultContext()) == 2.0
    diagram = _scales_fed_by_drake(Stone())
    with pytest.raises(WiringError) as error:
        diagram.GetOutputPort("weight").Eval(diagram.CreateDefaultContext())
    assert str(error.value) == "the input scales.content takes Fruit, not Stone"
