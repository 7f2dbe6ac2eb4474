"""What was asked for and has not been done yet: the only place where the threads of page and simulation meet."""

import threading
import time
from collections import deque
from collections.abc import Callable

from quadpips_drake.cockpit.choices import Choice
from quadpips_drake.cockpit.live_trial import LiveTrial

Order = Callable[[LiveTrial], str | None]
"""Does something to a trial; returns what has happened, in words."""


class Enough(KeyboardInterrupt):
    """Ends the run of a trial from within: another one is wanted, or none."""


class Controls:
    """Each method may be called from any thread; ``changed`` is the lock of all."""

    def __init__(self, choice: Choice, paused: bool):
        """Args: the first trial that is wanted; whether it stands still at first."""
        self.changed = threading.Condition()
        self._orders: deque[Order] = deque()
        self._paused, self._steps = paused, 0
        self._next: Choice | None = choice
        self._ended = False

    @property
    def stands_still(self) -> bool:
        """Whether no step is to be made now."""
        return self._paused and not self._steps

    def order(self, order: Order) -> None:
        """Wants ``order`` to be done between two steps."""
        with self.changed:
            self._orders.append(order)
            self.changed.notify_all()

    def pause(self, paused: bool) -> None:
        """Wants time to stand still, or to go on."""
        with self.changed:
            self._paused, self._steps = paused, 0
            self.order(_nothing)

    def step(self, number: int) -> None:
        """Wants so many steps, and then time to stand still."""
        with self.changed:
            self._steps += number
            self._paused = True
            self.changed.notify_all()

    def begin(self, choice: Choice) -> None:
        """Wants another trial; what was wanted of the present one is forgotten."""
        with self.changed:
            self._next, self._paused, self._steps = choice, False, 0
            self._orders.clear()
            self.changed.notify_all()

    def end(self) -> None:
        """Wants no trial any more."""
        with self.changed:
            self._ended = True
            self.changed.notify_all()

    def next_choice(self) -> Choice | None:
        """Waits for the next trial that is wanted; None: none any more."""
        with self.changed:
            self.changed.wait_for(lambda: self._ended or self._next is not None)
            choice, self._next = self._next, None
            return None if self._ended else choice

    def take_orders(self) -> list[Order]:
        """All that is to be done now."""
        with self.changed:
            orders = list(self._orders)
            self._orders.clear()
            return orders

    def wait(self, deadline: float) -> bool:
        """Waits for the ``deadline`` (of the monotonic clock [s]), at which the next step may be made; returns True then.

        Returns False as soon as there are orders.

        Raises:
            Enough: the trial is not wanted any more.
        """
        with self.changed:
            while True:
                if self._ended or self._next is not None:
                    raise Enough("the cockpit")
                if self._orders:
                    return False
                if self._paused and self._steps:
                    self._steps -= 1
                    return True
                left = None if self._paused else deadline - time.monotonic()
                if left is not None and left <= 0.0:
                    return True
                self.changed.wait(left)


def _nothing(live: LiveTrial) -> None:
    """An order that only makes the state of affairs be told."""
