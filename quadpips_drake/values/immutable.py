"""What every value on an abstract port has in common: it never changes once it is made."""

from numpy import ndarray


class ImmutableValue:
    """Mixin for ``@dataclass(frozen=True, eq=False)`` types that travel on abstract ports.

    Array fields become read-only on construction. Because nothing in it can change, a copy *is* the original: cloning a
    Drake context shares these values instead of duplicating megabytes of images.
    """

    def __post_init__(self):
        # By way of the instance's dictionary: values are made thousands of times a second, and dataclasses.fields is slow.
        values = vars(self)
        for name, value in values.items():
            if isinstance(value, ndarray) and value.flags.writeable:
                view = value.view()
                view.flags.writeable = False
                values[name] = view

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self
