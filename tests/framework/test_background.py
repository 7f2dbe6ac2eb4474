"""What is late may be computed by another thread: the same results at the same times, whatever takes how long."""

import threading

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.framework.background import Background, Deferred, value_of
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.framework.stage import Stage, compute_in_background
from quadpips_drake.framework.stage_config import StageConfig

LATENCY = 0.25


class Sum(Stage):
    """Adds its input to its memory, for each new text; may be held up, and may fail."""

    WORTH_A_THREAD = True

    def __init__(self, latency=LATENCY, rate=10.0, *, each_text=False, name="sum"):
        super().__init__(name, StageConfig(rate=rate, latency=latency), memory=(0.0,))
        self.gate, self.threads, self._each_text = threading.Event(), set(), each_text
        self.gate.set()
        self.declare_input("image", ImageDepth32F, example=ImageDepth32F(2, 2))
        self.declare_input("text", str, default="")
        self.declare_output("sums", tuple)

    def occasion(self, inputs):
        return (inputs.text or None) if self._each_text else super().occasion(inputs)

    def update(self, inputs, memory, time):
        self.threads.add(threading.current_thread())
        assert self.gate.wait(10.0)
        if inputs.text == "break":
            raise ArithmeticError("broken")
        return (*memory, memory[-1] + float(inputs.image.data[0, 0, 0]))


@pytest.fixture
def background():
    background = Background()
    yield background
    background.close()


def simulate(stage, until, background=None, text="", changes=None):
    """What the stage shows every 0.05 s while its image changes."""
    compute_in_background(stage, background)
    simulator = Simulator(stage)
    context, seen = simulator.get_mutable_context(), []
    image = ImageDepth32F(2, 2)
    for k in range(round(until / 0.05)):
        # The same buffer all the time, as a renderer's.
        image.mutable_data[:] = k
        stage.GetInputPort("image").FixValue(context, AbstractValue.Make(image))
        stage.GetInputPort("text").FixValue(context, AbstractValue.Make((changes or {}).get(k, text)))
        simulator.AdvanceTo(0.05 * (k + 1))
        if k == 3:
            stage.gate.set()
        seen.append(stage.GetOutputPort("sums").Eval(context))
    return seen


@pytest.mark.parametrize("latency", [0.05, 0.1, LATENCY])
@pytest.mark.parametrize("rate", [10.0, 20.0])
def test_results_and_their_times_are_those_of_one_thread(background, latency, rate):
    alone, beside = Sum(latency, rate), Sum(latency, rate)
    assert simulate(beside, 1.0, background) == simulate(alone, 1.0)
    assert alone.threads == {threading.main_thread()} and threading.main_thread() not in beside.threads


def test_the_simulation_goes_on_while_a_late_result_is_computed(background):
    held_up = Sum()
    held_up.gate.clear()  # opened after 0.2 s of simulated time, before the first result is due
    assert simulate(held_up, 1.0, background) == simulate(Sum(), 1.0)


def test_what_is_never_late_stays_with_the_simulation(background):
    prompt = Sum(0.0)
    simulate(prompt, 0.3, background)
    assert prompt.threads == {threading.main_thread()}


@pytest.mark.parametrize("beside", [False, True])
def test_there_is_one_update_for_each_occasion(background, beside):
    stage = Sum(each_text=True)
    seen = simulate(stage, 1.5, background if beside else None, changes={k: "ab"[k > 10] for k in range(2, 30)})
    # Looked at every 0.1 s: "a" from 0.1 s on, "b" from 0.6 s on.
    assert len(seen[-1]) == 3
    assert [len(sums) for sums in seen] == [1] * 7 + [2] * 10 + [3] * 13


def test_failures_come_to_light_when_the_result_is_due(background):
    with pytest.raises(ArithmeticError, match="broken"):
        simulate(Sum(), 1.0, background, changes={4: "break", 5: "break"})


def test_a_cloned_context_shares_what_is_being_computed(background):
    stage = Sum()
    compute_in_background(stage, background)
    simulator = Simulator(stage)
    image = ImageDepth32F(2, 2)
    image.mutable_data[:] = 1.0
    stage.GetInputPort("image").FixValue(simulator.get_mutable_context(), AbstractValue.Make(image))
    simulator.AdvanceTo(0.15)
    clone = simulator.get_context().Clone()
    simulator.AdvanceTo(1.0)
    again = Simulator(stage, clone)
    again.AdvanceTo(1.0)
    port = stage.GetOutputPort("sums")
    assert port.Eval(clone) == port.Eval(simulator.get_context()) and len(port.Eval(clone)) == 9


def test_all_stages_of_a_diagram_are_found_at_any_depth(background):
    inner, outer = DiagramBuilder(), DiagramBuilder()
    deep = inner.AddSystem(Sum(name="deep"))
    outer.AddSystem(inner.Build())
    near = outer.AddSystem(Sum(name="near"))
    diagram = outer.Build()
    compute_in_background(diagram, background)
    assert deep._background is near._background is background
    compute_in_background(diagram, None)
    assert deep._background is None


def test_threads_end_with_their_background():
    before = threading.active_count()
    background = Background()
    values = [background.compute(owner, lambda memory: memory + 1, 1) for owner in ("a", "b")]
    assert [value_of(value) for value in values] == [2, 2] and value_of(3) == 3
    assert all(isinstance(value, Deferred) for value in values)
    background.close()
    assert threading.active_count() == before


def test_arrays_at_vector_ports_are_kept():
    class Place(Stage):
        WORTH_A_THREAD = True

        def __init__(self):
            super().__init__("place", StageConfig(rate=10.0, latency=0.15), memory=np.zeros(2))
            self.declare_vector_input("place", 2)
            self.declare_vector_output("sum", 2, lambda memory: memory)

        def update(self, inputs, memory, time):
            return memory + inputs.place

    def last(background):
        stage = Place()
        compute_in_background(stage, background)
        simulator = Simulator(stage)
        for k in range(10):
            stage.GetInputPort("place").FixValue(simulator.get_mutable_context(), [k, 1.0])
            simulator.AdvanceTo(0.1 * (k + 1))
        return stage.GetOutputPort("sum").Eval(simulator.get_context())

    background = Background()
    np.testing.assert_array_equal(last(background), last(None))
    background.close()
