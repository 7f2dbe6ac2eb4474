"""LeafSystem and Diagram to derive from in Python: Drake's own, made so that the garbage collector can free them.

A diagram, its systems and their ports refer to each other in circles. Drake keeps these references in attributes of the
Python objects, where the collector sees them; two things would hide them from it, and one hidden reference keeps the whole
diagram for ever, tens of megabytes:

- An instance of an ordinary subclass has its ``__dict__`` counted twice by the collector, once for Python's and once for
  Drake's share of it, so that what is in there seems to be used from outside. Classes with empty ``__slots__`` use Drake's
  alone; they take attributes as any other.
- Functions that compute outputs are held in C++, and with them the system whose methods they are. Here the system holds
  them, where the collector sees it, and C++ gets weak references. (Drake does so for the functions of events.)

What else hides a circle: a cache entry, a body or a frame of a plant as an attribute of a system. Their indices do as well.
"""

from collections.abc import Callable
from weakref import proxy

from pydrake.systems import framework
from pydrake.systems.framework import CacheIndex, LeafOutputPort, ValueProducer


class _Collectable(type(framework.LeafSystem)):
    """Gives all classes empty ``__slots__``."""

    def __new__(cls, name, bases, namespace, **options):
        namespace.setdefault("__slots__", ())
        return super().__new__(cls, name, bases, namespace, **options)


class Diagram(framework.Diagram, metaclass=_Collectable):
    """Drake's Diagram."""


class LeafSystem(framework.LeafSystem, metaclass=_Collectable):
    """Drake's LeafSystem."""

    def DeclareAbstractOutputPort(self, name: str, alloc: Callable, calc: Callable, *more, **options) -> LeafOutputPort:
        """As in Drake."""
        return super().DeclareAbstractOutputPort(name, self._held(alloc), self._held(calc), *more, **options)

    def DeclareVectorOutputPort(self, name: str, model, calc: Callable, *more, **options) -> LeafOutputPort:
        """As in Drake; ``model``: size or model vector."""
        return super().DeclareVectorOutputPort(name, model, self._held(calc), *more, **options)

    def declare_cache_entry(self, description: str, allocate: Callable, calc: Callable, prerequisites: set) -> CacheIndex:
        """As Drake's DeclareCacheEntry, with the two functions of the ValueProducer; returns the entry's index."""
        producer = ValueProducer(self._held(allocate), self._held(calc))
        return self.DeclareCacheEntry(description, producer, prerequisites).cache_index()

    def _held(self, function: Callable) -> Callable:
        """A weak reference to ``function``, which lives as long as the system does."""
        self.__dict__.setdefault("_functions", []).append(function)
        return proxy(function)
