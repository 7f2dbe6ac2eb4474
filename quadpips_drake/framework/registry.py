"""Names for what can be swapped: planners, region sources, state estimators, robots, terrains, gaits, QP back-ends.

One mechanism for all kinds. An entry is a name, a factory, and (where there is something to configure) a configuration type.
Entries are added in one call,

    planners.add("toy", make_toy_planner, ToyConfig)

or by an installed package in its pyproject.toml, which makes them known to the command line as well:

    [project.entry-points."quadpips_drake.planners"]
    toy = "toy_package.planner:ENTRY"

where ENTRY is an ``Entry`` or a factory. Such packages are imported when a name is asked for that nobody else knows.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib import metadata

from quadpips_drake.errors import UserInputError, unknown_name


@dataclass(frozen=True)
class Entry:
    """What a name stands for."""

    factory: Callable
    """Makes it; which arguments it gets is said where the registry is defined."""
    config: type | None = None
    """Dataclass of its settings, with defaults; None: there is nothing to set."""
    summary: str = ""
    """One line for lists."""
    section: str = ""
    """Key of its settings below ``stages`` in config.yaml; default: the name."""
    name: str = ""
    """Filled in by the registry."""
    wishes: dict = field(default_factory=dict)
    """What it wants otherwise than the defaults in code, keys as below ``stages``; whatever is set counts more. Only
    those of planners are heard."""


class Registry:
    """Entries of one kind by name."""

    def __init__(self, kind: str, group: str):
        """Args: what an entry is, for messages ("planner"); the group of entry points of other packages."""
        self.kind, self.group = kind, group
        self._entries: dict[str, Entry] = {}

    def add(
        self,
        name: str,
        factory: Callable,
        config: type | None = None,
        *,
        summary: str = "",
        section: str = "",
        wishes: dict | None = None,
    ) -> Entry:
        """Adds an entry, or replaces the one of that name; for the arguments see ``Entry``.

        Raises:
            UserInputError: the name cannot be used as one on the command line.
        """
        if not isinstance(name, str) or not name.replace("-", "_").isidentifier():
            raise UserInputError(f"a {self.kind} cannot be called {name!r}; use a letter, then letters, digits, '_' and '-'")
        return self._keep(name, Entry(factory, config, summary, section, wishes=wishes or {}))

    def remove(self, name: str) -> None:
        """Takes an entry out; one that is not there is no mistake."""
        self._entries.pop(name, None)

    def names(self) -> list[str]:
        """All names, those of installed packages too, sorted."""
        return sorted({*self._entries, *(point.name for point in self._entry_points())})

    def get(self, name: str) -> Entry:
        """Returns the entry called ``name``.

        Raises:
            UserInputError: there is none (the message lists those that there are), two packages bring one, or its package
                cannot be imported.
        """
        if name not in self._entries:
            points = {point.value: point for point in self._entry_points() if point.name == name}
            if not points:
                raise unknown_name(self.kind, name, self.names())
            if len(points) > 1:
                places = " and ".join(sorted(points))
                raise UserInputError(
                    f"the {self.kind} '{name}' is brought by several packages ({places}); uninstall all but one"
                )
            self._keep(name, self._loaded(*points.values()))
        return self._entries[name]

    def __contains__(self, name: str) -> bool:
        return name in self._entries or name in self.names()  # packages are looked through only when they must be

    def _keep(self, name: str, entry: Entry) -> Entry:
        section = entry.section or name.replace("-", "_")
        self._entries[name] = replace(entry, name=name, section=section)
        return self._entries[name]

    def _entry_points(self):
        return metadata.entry_points(group=self.group)

    def _loaded(self, point: metadata.EntryPoint) -> Entry:
        try:
            loaded = point.load()
        except (Exception, SystemExit) as error:  # whatever a foreign package does wrong
            reason = " ".join(str(error).split()) or type(error).__name__
            raise UserInputError(f"the {self.kind} '{point.name}' ({point.value}) cannot be loaded: {reason}") from None
        if isinstance(loaded, Entry):
            return loaded
        if callable(loaded):
            return Entry(loaded)
        raise UserInputError(
            f"the {self.kind} '{point.name}' ({point.value}) must be an Entry or a factory, is {type(loaded).__name__}"
        )
