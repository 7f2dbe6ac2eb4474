"""When a stage computes, when its results are there, and whose computing time is whose."""

import time as clock

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import LeafSystem

from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.ports import DiagramBuilder, declare_output
from quadpips_drake.framework.stage import FirstUpdate, Stage
from quadpips_drake.framework.stage_config import OnDemandStageConfig, StageConfig
from quadpips_drake.timing import StageTimings

RATE = 10.0
KINDS = list(FirstUpdate)


class Clock(LeafSystem):
    """Tells the time."""

    def __init__(self):
        super().__init__()
        self.set_name("clock")
        declare_output(self, "time", float, lambda context: context.get_time(), {self.time_ticket()})


class Diary(Stage):
    """Remembers, as a tuple, what it read and when."""

    def __init__(self, config, *, read="text", **kwargs):
        super().__init__(kwargs.pop("name", "diary"), config, memory=(), **kwargs)
        self.calls, self._read = 0, read
        self.declare_input("text", str, default="-")
        self.declare_input("time", float, default=-1.0)
        self.declare_input("entries", tuple, default=())
        self.declare_vector_input("place", 2, default=None)
        self.declare_output("entries", tuple)
        self.declare_vector_output("length", 1, lambda memory: [len(memory)])

    def update(self, inputs, memory, time):
        self.calls += 1
        if inputs.text == "nothing new":
            return memory
        value = getattr(inputs, self._read)
        return (*memory, (round(time, 6), value))


class InitializedDiary(Diary):
    """Begins in another way than it goes on."""

    def initialize(self, inputs, memory, time):
        return ((round(time, 6), "begun"),)


def config(latency=0.0, rate=RATE):
    return StageConfig(rate=rate, latency=latency)


def fed(diary, **values):
    """A simulator of a stage, its inputs fixed to ``values``."""
    simulator = Simulator(diary)
    for name, value in values.items():
        diary.GetInputPort(name).FixValue(simulator.get_mutable_context(), AbstractValue.Make(value))
    return simulator


def entries(diary, simulator):
    return diary.GetOutputPort("entries").Eval(diary.GetMyContextFromRoot(simulator.get_context()))


def times(diary, simulator):
    return [time for time, _ in entries(diary, simulator)]


@pytest.mark.parametrize(
    ("first", "expected"),
    [
        (FirstUpdate.AT_INITIALIZATION, [0.0, 0.1, 0.2, 0.3]),
        (FirstUpdate.AT_ONCE, [0.0, 0.1, 0.2, 0.3]),
        (FirstUpdate.AFTER_ONE_PERIOD, [0.1, 0.2, 0.3]),
    ],
)
def test_updates_happen_every_period(first, expected):
    diary = Diary(config(), first=first)
    simulator = fed(diary)
    assert entries(diary, simulator) == ()
    simulator.Initialize()
    assert times(diary, simulator) == ([0.0] if first is FirstUpdate.AT_INITIALIZATION else [])
    simulator.AdvanceTo(0.35)
    assert times(diary, simulator) == expected
    assert diary.GetOutputPort("length").Eval(simulator.get_context()) == len(expected)


def test_the_first_update_may_be_another():
    diary = InitializedDiary(config(), first=FirstUpdate.AT_INITIALIZATION)
    simulator = fed(diary, text="later")
    simulator.AdvanceTo(0.15)
    assert entries(diary, simulator) == ((0.0, "begun"), (0.1, "later"))


@pytest.mark.parametrize("first", KINDS)
@pytest.mark.parametrize("latency", [0.0, 0.03, 0.1, 0.23, 0.3])
def test_results_appear_as_much_later_as_the_latency_says(first, latency):
    """Shorter than a period, a period, longer, and a multiple of it."""
    diary = Diary(config(latency), first=first)
    simulator = fed(diary)
    begun = [0.0] if first is FirstUpdate.AT_INITIALIZATION else []
    updates = np.arange(0 if first is FirstUpdate.AT_ONCE else 1, 11) * 0.1
    for now in np.arange(1, 101) * 0.01:
        for moment in (now - 1e-6, now + 1e-6):
            simulator.AdvanceTo(moment)
            expected = [*begun, *(time for time in updates if time + latency < moment)]
            assert times(diary, simulator) == pytest.approx(expected), f"at {moment} s"


def test_a_late_stage_goes_on_from_its_newest_memory():
    late, prompt = Diary(config(0.25)), Diary(config())
    of_late, of_prompt = fed(late), fed(prompt)
    of_late.AdvanceTo(0.76)
    of_prompt.AdvanceTo(0.51)
    # Nothing is lost on the way, although only every result of before 0.25 s was there when the next one was begun.
    assert entries(late, of_late) == entries(prompt, of_prompt)
    assert times(late, of_late) == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])


@pytest.mark.parametrize("latency", [0.0, 0.1, 0.04])
def test_who_computes_at_the_same_time_sees_what_was_there_before(latency):
    builder = DiagramBuilder()
    writer = builder.AddSystem(Diary(config(latency), name="writer"))
    reader = builder.AddSystem(Diary(config(rate=50.0), read="entries", name="reader"))
    builder.Connect(writer.GetOutputPort("entries"), reader.GetInputPort("entries"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.45)
    for time, seen in entries(reader, simulator):
        # Events at one time happen together, so that a result is seen strictly after it has appeared.
        expected = [k for k in range(5) if 0.1 * k + latency < time - 1e-6]
        assert len(seen) == len(expected), f"at {time} s"


def test_a_cloned_context_goes_on_in_the_same_way():
    diary = Diary(config(0.25))
    simulator = fed(diary, text="a")
    simulator.AdvanceTo(0.42)
    clone = simulator.get_context().Clone()
    simulator.AdvanceTo(1.0)
    again = Simulator(diary, clone)
    again.AdvanceTo(1.0)
    assert diary.GetOutputPort("entries").Eval(clone) == entries(diary, simulator)
    assert len(entries(diary, simulator)) == 8


def test_when_nothing_is_to_be_done_nothing_is_timed():
    timings = StageTimings()
    diary = Diary(config(0.05), label="writing", timings=timings)
    simulator = fed(diary, text="nothing new")
    simulator.AdvanceTo(0.35)
    assert diary.calls == 4 and timings.summary_ms() == {} and entries(diary, simulator) == ()
    diary.GetInputPort("text").FixValue(simulator.get_mutable_context(), AbstractValue.Make("news"))
    simulator.AdvanceTo(0.55)
    assert timings.summary_ms()["writing"]["n"] == 2 and len(timings.summary_ms()) == 1
    assert Diary(config(), timings=timings)._label == "diary"


class Slow(Stage):
    """A stage without a rate that takes a while of a clock that the test winds."""

    def __init__(self, wall, timings):
        super().__init__("slow", OnDemandStageConfig(), memory="", timings=timings)
        self._wall = wall
        self.declare_input("time", float)
        self.declare_output("text", str)

    def update(self, inputs, memory, time):
        self._wall.now += 2.0
        return f"{inputs.time:g}"


class Quick(Diary):
    """Takes one second of that clock, before and after it has read its input."""

    def __init__(self, wall, timings):
        super().__init__(config(), name="quick", timings=timings)
        self._wall = wall

    def update(self, inputs, memory, time):
        self._wall.now += 0.25
        entry = (inputs.text, inputs.text)
        self._wall.now += 0.75
        return (*memory, (time, entry))


class Wall:
    """A wall clock by hand."""

    now = 0.0


def test_time_spent_in_waiting_for_inputs_is_theirs(monkeypatch):
    wall, timings = Wall(), StageTimings()
    monkeypatch.setattr(clock, "perf_counter", lambda: wall.now)
    builder = DiagramBuilder()
    source, slow, quick = (builder.AddSystem(system) for system in (Clock(), Slow(wall, timings), Quick(wall, timings)))
    builder.Connect(source.get_output_port(), slow.GetInputPort("time"))
    builder.Connect(slow.GetOutputPort("text"), quick.GetInputPort("text"))
    Simulator(builder.Build()).AdvanceTo(0.35)
    summary = timings.summary_ms()
    assert {name: (entry["n"], entry["p50"], entry["max"]) for name, entry in summary.items()} == {
        "slow": (4, 2000.0, 2000.0),
        "quick": (4, 1000.0, 1000.0),
    }


def test_a_stage_without_a_rate_computes_when_its_inputs_have_changed():
    timings = StageTimings()
    diary = Diary(OnDemandStageConfig(), timings=timings)
    context = diary.CreateDefaultContext()
    read = lambda name: diary.GetOutputPort(name).Eval(context)  # noqa: E731
    assert diary.calls == 0
    assert read("entries") == ((0.0, "-"),) and read("length") == 1
    context.SetTime(3.0)
    assert read("entries") == ((0.0, "-"),)
    assert diary.calls == timings.summary_ms()["diary"]["n"] == 1, "one computation for all outputs, while inputs last"
    diary.GetInputPort("text").FixValue(context, AbstractValue.Make("b"))
    # It has no memory: each result is like the first.
    assert read("entries") == ((3.0, "b"),) and read("length") == 1 and diary.calls == 2
    assert context.num_abstract_states() == 0
    assert diary.GetOutputPort("entries").Eval(context.Clone()) == ((3.0, "b"),)


def test_a_stage_without_a_rate_may_be_given_one():
    diary = Diary(OnDemandStageConfig(rate=RATE, latency=0.05))
    simulator = fed(diary)
    simulator.AdvanceTo(0.12)
    assert times(diary, simulator) == [0.0] and diary.calls == 2


class Constant(Stage):
    """Has no inputs."""

    def __init__(self, config):
        super().__init__("constant", config, memory=0)
        self.declare_output("number", int)

    def update(self, inputs, memory, time):
        return 7


@pytest.mark.parametrize("config", [OnDemandStageConfig(), StageConfig()])
def test_a_stage_needs_no_inputs(config):
    stage = Constant(config)
    simulator = fed(stage)
    simulator.AdvanceTo(0.01)
    assert stage.GetOutputPort("number").Eval(simulator.get_context()) == 7


@pytest.mark.parametrize(
    ("name", "value", "default"), [("text", "given", "-"), ("time", 2.5, -1.0), ("place", np.array([1.0, 2.0]), None)]
)
def test_inputs_with_a_default_may_stay_unconnected(name, value, default):
    diary = Diary(config(), read=name)
    simulator = fed(diary)
    simulator.AdvanceTo(0.01)
    assert entries(diary, simulator)[0][1] == default
    port, context = diary.GetInputPort(name), simulator.get_mutable_context()
    port.FixValue(context, value if name == "place" else AbstractValue.Make(value))
    simulator.AdvanceTo(0.11)
    np.testing.assert_array_equal(entries(diary, simulator)[1][1], value)


class Strict(Stage):
    """Has an input that must be connected, and asks for one that there is not."""

    def __init__(self, asked):
        super().__init__("strict", config(), memory="")
        self._asked = asked
        self.declare_input("text", str)
        self.declare_output("text", str)

    def update(self, inputs, memory, time):
        return getattr(inputs, self._asked)


def test_an_input_that_is_missing_is_named():
    with pytest.raises(RuntimeError, match=r"text.*not connected"):
        fed(Strict("text")).AdvanceTo(0.01)
    with pytest.raises(AttributeError, match="no input port 'txt'; there are text"):
        fed(Strict("txt"), text="a").AdvanceTo(0.01)


def test_an_input_after_the_first_output_is_refused_where_it_would_not_be_noticed():
    class Hasty(Stage):
        def __init__(self):
            super().__init__("hasty", OnDemandStageConfig(), memory=0)
            self.declare_output("number", int)
            self.declare_input("text", str)

    with pytest.raises(RuntimeError, match="hasty: declare all inputs before the first output, 'text' too"):
        Hasty()


@pytest.mark.parametrize("rate", [0.0, -1.0, 1e-4, 10_001.0, np.nan, np.inf])
def test_bad_rates_are_refused(rate):
    with pytest.raises(UserInputError, match="rate must be"):
        StageConfig(rate=rate)


@pytest.mark.parametrize("kind", [StageConfig, OnDemandStageConfig])
@pytest.mark.parametrize("latency", [-0.01, 10.1, np.nan, np.inf])
def test_bad_latencies_are_refused(kind, latency):
    with pytest.raises(UserInputError, match="latency must be"):
        kind(rate=5.0, latency=latency)


def test_only_a_stage_with_a_rate_can_be_late():
    assert OnDemandStageConfig().period == 0.0 and StageConfig(rate=4.0).period == 0.25
    with pytest.raises(UserInputError, match="a latency needs a rate"):
        OnDemandStageConfig(latency=0.1)
    with pytest.raises(UserInputError, match="rate must be 0"):
        OnDemandStageConfig(rate=-1.0)
