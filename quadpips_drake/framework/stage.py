"""The base of all stages: systems that compute at a rate, remember something, and may be late.

A stage is its ports and one call of its algorithm,

    m[k+1] = update(inputs(t_k), m[k], t_k),    t_k = k / rate,

and each output is read off the memory m. With a latency L, outputs show m[k+1] only after t_k + L, while the stage itself
goes on from its newest memory, as a process does that runs beside the others and takes its time. Both are simulated time:
they are the same on every machine. A stage without a rate has no memory; its outputs are computed when they are read.

What is late may be computed in the background (``framework/background.py``); that changes no result.
"""

from collections.abc import Callable, Hashable
from copy import deepcopy
from enum import Enum
from functools import partial
from math import inf
from typing import Any, NamedTuple

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    AbstractStateIndex,
    CacheIndex,
    EventStatus,
    InputPort,
    OutputPort,
    System,
)

from quadpips_drake.compiling import work_clock
from quadpips_drake.framework.background import Background, stages_of, value_of
from quadpips_drake.framework.ports import WiringError, declare_input, declare_output, full_name, value_type
from quadpips_drake.framework.stage_config import StageConfig
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.timing import StageTimings

_SAME_TIME = 1e-9
"""Events closer than this are at the same time [s]."""
_REQUIRED = object()
EVERY_TIME = object()
"""The occasion of stages that compute at every period."""


class _Remembered(NamedTuple):
    """The state of a stage with a rate."""

    occasion: Hashable
    """Of the update that was begun last."""
    results: tuple
    """((time, memory), ...): since when outputs show it, from what they show now on to the newest."""

    def __deepcopy__(self, memo):
        # Never changed in place; Drake copies the state of all systems at each step of the physics.
        return self


class FirstUpdate(Enum):
    """When a stage with a rate computes for the first time."""

    AT_INITIALIZATION = "before the simulation's first step; from then on every period"
    AT_ONCE = "at time 0, together with everybody else who does"
    AFTER_ONE_PERIOD = "when the first period is over"


class Inputs:
    """The values at a stage's input ports at one time, as attributes; each is evaluated when it is first asked for."""

    def __init__(self, ports: dict, context):
        self._ports, self._context = ports, context
        self.waited = 0.0
        """Wall-clock time in which other systems computed these values [s]."""

    def __getattr__(self, name: str):
        ports = self.__dict__["_ports"]
        if name not in ports:
            raise AttributeError(f"there is no input port '{name}'; there are {', '.join(ports)}")
        start = work_clock()
        value = ports[name].read(self._context)
        self.__dict__[name] = value
        self.__dict__["waited"] += work_clock() - start
        return value

    def detach(self) -> None:
        """Evaluates all of them now, so that they can be used when the context has gone on."""
        for name in self._ports:
            self.__dict__[name] = _kept(getattr(self, name))
        self.__dict__["_context"] = None


def _kept(value):
    """``value`` itself if it never changes, else a copy: a buffer of Drake's is overwritten by the next value."""
    if hasattr(value, "mutable_data"):  # an image, which does not know how to be copied
        image = type(value)(value.width(), value.height())
        image.mutable_data[:] = value.data
        return image
    return deepcopy(value)


class _Port:
    """An input port with the type of its values and what counts while it is not connected."""

    def __init__(self, port: InputPort, default):
        self.port, self._default, self._kind = port, default, value_type(port)

    def read(self, context):
        if self._default is not _REQUIRED and not self.port.HasValue(context):
            return self._default
        value = self.port.Eval(context)
        if self._kind is not None and not isinstance(value, self._kind):
            # Wired by other means than our DiagramBuilder.
            raise WiringError(f"the input {full_name(self.port)} takes {self._kind.__name__}, not {type(value).__name__}")
        return value


class Stage(LeafSystem):
    """A system that is its ports and one call of its algorithm; see the head of this file.

    Subclasses declare their ports in the constructor, all inputs before the first output, and implement ``update``.
    """

    WORTH_A_THREAD = False
    """Whether it pays to compute late results of this stage in the background: whether an update takes milliseconds."""

    def __init__(
        self,
        name: str,
        config: StageConfig,
        *,
        memory: Any,
        label: str = "",
        timings: StageTimings | None = None,
        first: FirstUpdate = FirstUpdate.AT_ONCE,
    ):
        """
        Args:
            name: of the system.
            config: rate and latency.
            memory: what the stage remembers before the first update; never changed in place.
            label: under which computing times are filed; default: the name.
            timings: the stopwatch that collects them.
            first: when the first update happens.
        """
        super().__init__()
        self.set_name(name)
        self.config = config
        self.timings = timings or StageTimings()
        self._label = label or name
        self._ports: dict[str, _Port] = {}
        self._initial = memory
        self._state: int | None = None
        """Index of the abstract state that holds what is _Remembered; None without a rate."""
        self._background: Background | None = None
        self._on_demand: CacheIndex | None = None
        """Without a rate: of the cache entry with what was computed last."""
        if config.rate > 0.0:
            self._declare_updates(first)

    def update(self, inputs: Inputs, memory: Any, time: float) -> Any:
        """Returns the new memory; the old one itself if there was nothing to do.

        Args:
            inputs: values of the input ports by name; the default of an optional one that is not connected.
            memory: what the last update returned; without a rate always the first memory.
            time: simulated time [s]. Without a rate the result must not depend on it: it is kept while the inputs last.
        """
        raise NotImplementedError

    def occasion(self, inputs: Inputs) -> Hashable | None:
        """For what there would be an update now, an id of a request for instance; None: for nothing.

        A stage with a rate makes one update for each occasion; as long as it stays the same, nothing happens.
        """
        return EVERY_TIME

    def initialize(self, inputs: Inputs, memory: Any, time: float) -> Any:
        """The update before the first step (``FirstUpdate.AT_INITIALIZATION``), where it is not like any other."""
        return self.update(inputs, memory, time)

    def declare_input(self, name: str, kind: type, *, default=_REQUIRED, example=None) -> InputPort:
        """Declares an input port for values of type ``kind``; with a ``default`` it may stay unconnected."""
        return self._keep(name, declare_input(self, name, kind, example=example), default)

    def declare_vector_input(self, name: str, size: int, *, default=_REQUIRED) -> InputPort:
        """Declares an input port for vectors of ``size`` numbers; with a ``default`` it may stay unconnected."""
        return self._keep(name, self.DeclareVectorInputPort(name, size), default)

    def declare_output(self, name: str, kind: type, read: Callable = lambda memory: memory, *, example=None) -> OutputPort:
        """Declares an output port for values of type ``kind``: ``read(memory)``; after all inputs."""
        return declare_output(
            self, name, kind, lambda context: read(self.shown_memory(context)), self.memory_tickets(), example=example
        )

    def declare_vector_output(self, name: str, size: int, read: Callable) -> OutputPort:
        """Declares an output port for vectors of ``size`` numbers: ``read(memory)``; after all inputs."""

        def write(context, output):
            output.SetFromVector(read(self.shown_memory(context)))

        return self.DeclareVectorOutputPort(name, size, write, self.memory_tickets())

    def inputs(self, context) -> Inputs:
        """The values at the input ports in ``context``, for outputs that look at them directly."""
        return Inputs(self._ports, context)

    def is_initial(self, memory: Any) -> bool:
        """Whether nothing has been remembered yet."""
        return memory is self._initial

    def shown_memory(self, context) -> Any:
        """The memory that outputs show in ``context``."""
        if self._state is None:
            return self.get_cache_entry(self._on_demand).Eval(context)
        results = self._remembered(context).results
        if self.config.latency > 0.0:
            results = _from_shown_on(results, context.get_time())
        return value_of(results[0][1])

    def memory_tickets(self) -> set:
        """Tickets of what the outputs depend on; after all inputs."""
        if self._state is not None:
            state = self.abstract_state_ticket(AbstractStateIndex(self._state))
            return {state} if self.config.latency == 0.0 else {state, self.time_ticket()}
        if self._on_demand is None:
            self._on_demand = self._declare_on_demand()
        return {self.cache_entry_ticket(self._on_demand)}

    def _keep(self, name: str, port: InputPort, default) -> InputPort:
        if self._on_demand is not None:  # which would not notice that this input changes
            raise RuntimeError(f"{self.get_name()}: declare all inputs before the first output, '{name}' too")
        self._ports[name] = _Port(port, default)
        return port

    def _declare_on_demand(self) -> CacheIndex:
        def calculate(context, value):
            value.set_value(self._timed(self.update, self._initial, self.inputs(context), context.get_time()))

        tickets = {entry.port.ticket() for entry in self._ports.values()} or {self.nothing_ticket()}
        return self.declare_cache_entry("memory", lambda: AbstractValue.Make(self._initial), calculate, tickets)

    def _declare_updates(self, first: FirstUpdate) -> None:
        remembered = _Remembered(None, ((-inf, self._initial),))
        self._state = int(self.DeclareAbstractState(AbstractValue.Make(remembered)))
        if first is FirstUpdate.AT_INITIALIZATION:
            self.DeclareInitializationUnrestrictedUpdateEvent(self._initialize)
        offset = 0.0 if first is FirstUpdate.AT_ONCE else self.config.period
        self.DeclarePeriodicUnrestrictedUpdateEvent(self.config.period, offset, self._update)

    def _timed(self, function: Callable, memory: Any, inputs: Inputs, time: float) -> Any:
        """``function`` called and timed; what it waited for its inputs is theirs."""
        start, waited = work_clock(), inputs.waited
        result = function(inputs, memory, time)
        if result is not memory:
            self.timings.record(self._label, work_clock() - start - (inputs.waited - waited))
        return result

    def _initialize(self, context, state):
        last = self._remembered(context)
        memory = self._timed(self.initialize, last.results[-1][1], self.inputs(context), context.get_time())
        # There is no time before the first step in which it could be late.
        self._remember(state, _Remembered(last.occasion, ((-inf, memory),)))
        return EventStatus.Succeeded()

    def _update(self, context, state):
        last, now, inputs = self._remembered(context), context.get_time(), self.inputs(context)
        occasion = self.occasion(inputs)
        if occasion is None or (occasion is not EVERY_TIME and occasion == last.occasion):
            return EventStatus.DidNothing()
        newest = last.results[-1][1]
        if self._background is not None:
            inputs.detach()
            memory = self._background.compute(self, partial(self._timed, self.update), newest, inputs, now)
        else:
            memory = self._timed(self.update, value_of(newest), inputs, now)
        results = last.results
        if memory is not newest:
            late = self.config.latency > 0.0
            results = (*_from_shown_on(results, now), (now + self.config.latency, memory)) if late else ((now, memory),)
        elif occasion is EVERY_TIME:
            return EventStatus.DidNothing()
        self._remember(state, _Remembered(occasion, results))
        return EventStatus.Succeeded()

    def _remembered(self, context) -> _Remembered:
        return context.get_abstract_state(self._state).get_value()

    def _remember(self, state, remembered: _Remembered) -> None:
        state.get_mutable_abstract_state(self._state).set_value(remembered)


def _from_shown_on(results: tuple, now: float) -> tuple:
    """The part of ``results`` that begins with what outputs show at the time ``now``.

    Not by events of their own: of two periodic events that are a rounding error apart, Drake may leave one out.
    """
    while len(results) > 1 and results[1][0] < now - _SAME_TIME:
        results = results[1:]
    return results


def compute_in_background(system: System, background: Background | None) -> None:
    """Has all stages in ``system`` for which it pays compute their late results in the ``background``; None: no longer."""
    for stage in stages_of(system, Stage):
        stage._background = background if stage.WORTH_A_THREAD and stage.config.latency > 0.0 else None
