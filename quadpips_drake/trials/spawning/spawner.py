"""What appears during a trial (``--spawn``): moved into the world at its time, noticed and touched or not."""

from dataclasses import replace

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.ports import output_names, output_of
from quadpips_drake.sensing.contact_sensing import links_that_touch, overlaps
from quadpips_drake.terrain.appearing.appearances import Appearance, parse_appearance
from quadpips_drake.terrain.penetration import sphere_depths
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import GroundHeights

FOOTHOLD_LEAD = 1.5
"""What appears on a foothold does so at least as long before the foot comes down there [s]."""
ROOM = 0.05
"""... and so far beside the feet on footholds that come sooner [m]."""
MAX_SPAWNED = 50
"""Elements that may appear in a trial."""
_SAME_TIME = 1e-9
_RAISED = 0.03
"""Ground is higher than before where it has risen by this much [m]."""


def parse_spawns(texts: list[str], duration: float) -> tuple[Appearance, ...]:
    """Reads what shall appear in a trial of ``duration`` [s]; raises UserInputError for what makes no sense."""
    spawns = tuple(parse_appearance(text) for text in texts)
    for spawn in spawns:
        if spawn.time >= duration:
            raise UserInputError(f"spawn '{spawn.text}': the time must be before the end of the trial, {duration:g} s")
    count = sum(len(spawn.elements) for spawn in spawns)
    if count > MAX_SPAWNED:
        raise UserInputError(f"spawn: {count} elements are to appear, at most {MAX_SPAWNED} may")
    return spawns


class _Spawned:
    """One appearance in a trial that goes on."""

    def __init__(self, spawn: Appearance, first: int):
        self.spawn, self.numbers = spawn, range(first, first + len(spawn.elements))
        """What, and the numbers of its elements in the station."""
        self.at: float | None = None
        """When it appeared [s]; None: not yet."""
        self.noticed: float | None = None
        self.touched_by: list[str] = []
        """Links and feet that have touched it, in the order in which they did."""
        self.geometries: set = set()
        self.terrain: Terrain | None = None
        """Its elements alone, where they appeared."""
        self.cells: tuple | None = None
        """x, y of places that it has raised and heights half-way up there [m], each (n,)."""

    def is_shown_by(self, heights: GroundHeights) -> bool:
        """Whether a map of the ground shows anything of it."""
        x, y, half_way = self.cells
        return bool((heights.at(x, y) > half_way).any())

    def plain(self) -> dict:
        """For result.json."""
        at, noticed = (None if t is None else round(t, 3) for t in (self.at, self.noticed))
        return {
            "what": self.spawn.text,
            "at": at,
            "noticed": noticed,
            "touched": bool(self.touched_by),
            "touched_by": self.touched_by,
        }


class Spawner:
    """Lets elements appear in a diagram and watches what becomes of them."""

    def __init__(self, spawns: tuple[Appearance, ...], diagram, terrain: Terrain, first: int = 0):
        """
        Args:
            spawns: what appears.
            diagram: one of all, with all their elements ``appearing``.
            terrain: before anything has appeared.
            first: number of the first of these elements in the station.
        """
        self._diagram, self._station, self._robot, self.terrain = diagram, diagram.station, diagram.robot, terrain
        """``terrain``: with all that has appeared so far."""
        firsts = np.cumsum([first, *(len(spawn.elements) for spawn in spawns)])
        self._all = [_Spawned(spawn, int(first)) for spawn, first in zip(spawns, firsts, strict=False)]

    @property
    def is_waiting(self) -> bool:
        """Whether there is anything that has not appeared yet."""
        return any(spawned.at is None for spawned in self._all)

    def advance(self, context, time: float, reference: WholeBodyReference) -> bool:
        """Lets appear what is due at ``time`` [s]; returns whether the terrain is another one now.

        Raises:
            UserInputError: something would appear inside the robot, or nowhere.
        """
        before = self.terrain
        for spawned in self._all:
            if spawned.at is None and time >= spawned.spawn.time - _SAME_TIME:
                self._appear(spawned, context, time, reference)
        return self.terrain is not before

    def add(self, spawn: Appearance, first: int, context, time: float) -> None:
        """Lets ``spawn`` appear at once, as the station's elements from number ``first`` on.

        Raises:
            UserInputError: it would be inside the robot, or nowhere; nothing has changed then.
        """
        spawned = _Spawned(spawn, first)
        try:
            self._appear(spawned, context, time, WholeBodyReference.empty())
        except UserInputError:
            self._station.sink(context, spawned.numbers)
            raise
        self._all.append(spawned)

    def watch(self, context, time: float) -> None:
        """Takes down what is touched and what has been noticed."""
        there = [spawned for spawned in self._all if spawned.at is not None]
        if not there:
            return
        results = self._diagram.GetOutputPort("contact_results").Eval(context)
        for spawned in there:
            links = links_that_touch(results, self._station.contact_geometries, spawned.geometries)
            spawned.touched_by += [link for link in links if link not in spawned.touched_by]
            if spawned.noticed is None and self._is_noticed(spawned, context):
                spawned.noticed = time

    def appeared(self) -> list[tuple[float, Terrain]]:
        """What has appeared: when [s], and its elements."""
        return [(spawned.at, spawned.terrain) for spawned in self._all if spawned.at is not None]

    def places(self) -> list[list]:
        """What has appeared so far, each element with its number in the station, the time [s] and its X_WE (16 numbers)."""
        there = [spawned for spawned in self._all if spawned.at is not None]
        return [
            [number, spawned.at, element.X_WE.ravel().tolist()]
            for spawned in there
            for number, element in zip(spawned.numbers, spawned.terrain.elements, strict=True)
        ]

    def plain(self) -> list[dict]:
        """For result.json, in the order in which it was asked for."""
        return [spawned.plain() for spawned in self._all]

    def _appear(self, spawned: _Spawned, context, time: float, reference: WholeBodyReference) -> None:
        for elements in self._places(spawned.spawn, time, reference):
            if self._put(spawned, context, elements):
                spawned.at, spawned.terrain = time, replace(self.terrain, elements=elements)
                self._find_cells(spawned)
                self.terrain = replace(self.terrain, elements=(*self.terrain.elements, *elements))
                return
        if not spawned.spawn.on_foothold:
            raise UserInputError(
                f"spawn '{spawned.spawn.text}': the robot is there at {time:.2f} s; choose another place or another time"
            )
        self._station.sink(context, spawned.numbers)  # until there is such a foothold

    def _places(self, spawn: Appearance, time: float, reference: WholeBodyReference):
        """Yields the elements in the places that they may have now, in order of preference."""
        if spawn.is_fixed:
            yield spawn.elements
        elif not spawn.on_foothold:
            yield spawn.standing_at(*self._ground_at(spawn))
        else:
            soon = time + FOOTHOLD_LEAD - _SAME_TIME
            sooner = np.array([f.position for f in reference.footholds if time < f.touchdown_time < soon]).reshape(-1, 3)
            for foothold in reference.footholds:
                if foothold.touchdown_time >= soon:
                    ground = foothold.position - self._robot.foot_radius * foothold.normal
                    elements = spawn.standing_at(ground, foothold.normal)
                    alone = replace(self.terrain, elements=elements)
                    if not sphere_depths(alone, sooner, self._robot.foot_radius + ROOM).any():
                        yield elements

    def _put(self, spawned: _Spawned, context, elements: tuple) -> bool:
        """Puts the elements into the world; returns whether there is room beside the robot."""
        station = self._station
        touchable = [station.let_appear(context, k, e.X_WE) for k, e in zip(spawned.numbers, elements, strict=True)]
        spawned.geometries = set().union(*touchable)
        query = station.GetOutputPort("query_object").Eval(station.GetMyContextFromRoot(context))
        return not overlaps(query, station.contact_geometries, spawned.geometries)

    def _ground_at(self, spawn: Appearance) -> tuple[np.ndarray, np.ndarray]:
        """Point (3,) and normal (3,) of the ground on which it appears."""
        truth, (x, y) = GroundTruth(self.terrain), spawn.on_ground
        z = float(truth.height(x, y))
        if not np.isfinite(z):
            raise UserInputError(f"spawn '{spawn.text}': there is no ground at ({x:g}, {y:g}); give X,Y,Z of its centre")
        return np.array([x, y, z]), np.array(truth.normal(x, y))

    def _find_cells(self, spawned: _Spawned) -> None:
        """Notes where the ground is higher than it was, and what height is half-way up there."""
        low, high = spawned.terrain.bounds()
        sides = [np.linspace(low[i], high[i], 12)[1:-1] for i in (0, 1)]
        x, y = (grid.ravel() for grid in np.meshgrid(*sides))
        above = GroundTruth(spawned.terrain).height(x, y)
        before = np.nan_to_num(GroundTruth(self.terrain).height(x, y), nan=low[2])
        raised = above > before + _RAISED
        spawned.cells = x[raised], y[raised], 0.5 * (above + before)[raised]

    def _is_noticed(self, spawned: _Spawned, context) -> bool:
        """Whether the map of the ground that planning gets, if there is one, shows it."""
        regions = getattr(self._diagram, "regions", None)
        if regions is None or "ground_heights" not in output_names(regions):
            return False
        heights = output_of(regions, "ground_heights", GroundHeights).Eval(regions.GetMyContextFromRoot(context))
        return spawned.is_shown_by(heights)
