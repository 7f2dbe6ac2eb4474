"""Elements that are not there from the beginning: what appears, where and when, as one line of text.

    box:L,W,H@PLACE@TIME        cylinder:RADIUS,LENGTH@PLACE@TIME        sphere:RADIUS@PLACE@TIME        FILE.yaml@TIME

PLACE is X,Y (upright on the ground there), X,Y,Z[,YAW] (of the element's centre) or ``foothold``. TIME in s, also as t=4.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.files.terrain_file import read_terrain_file
from quadpips_drake.terrain.terrain import Box, Cylinder, Element, Sphere, pose
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.steppability import Steppability

FOOTHOLD = "foothold"
"""The place of an element that comes down on a foothold that is planned."""
_KINDS = {"box": (3, "L,W,H"), "cylinder": (2, "RADIUS,LENGTH"), "sphere": (1, "RADIUS")}
"""How many numbers say how large, and their names."""
_RIGHT = "write KIND:SIZE@X,Y[,Z[,YAW]]@TIME, KIND:SIZE@foothold@TIME or FILE.yaml@TIME, for example box:0.3,0.3,0.2@1.5,0@4"


@dataclass(frozen=True, eq=False)
class Appearance(ImmutableValue):
    """What appears together."""

    text: str
    """As it was asked for."""
    time: float
    """When [s]."""
    elements: tuple[Element, ...]
    """What. Unless they are ``fixed`` it is one element, at the origin of W."""
    on_ground: np.ndarray | None = None
    """x, y [m] of the ground on which the element stands; None: somewhere else."""
    on_foothold: bool = False
    """Whether it stands on a foothold that is coming."""

    @property
    def is_fixed(self) -> bool:
        """Whether the elements are where they will appear."""
        return self.on_ground is None and not self.on_foothold

    def standing_at(self, point: np.ndarray, normal: np.ndarray) -> tuple[Element, ...]:
        """The element upright on ground at ``point`` (3,) [m] in W with the upward unit ``normal`` (3,)."""
        (element,) = self.elements
        X_WE, x = np.eye(4), np.cross((0.0, 1.0, 0.0), normal)  # not turned about the normal: y across, as in W
        x = x / np.linalg.norm(x)
        X_WE[:3, :3] = np.column_stack((x, np.cross(normal, x), normal))
        X_WE[:3, 3] = point + _half_height(element) * normal
        return (replace(element, X_WE=X_WE),)


def parse_appearance(text: str) -> Appearance:
    """Reads one line of the form above; raises UserInputError with one line when it has another."""
    what, _, when = text.rpartition("@")
    kind, colon, size = what.partition("@")[0].partition(":")
    time = _number(when.removeprefix("t="))
    if time is None or time < 0.0:
        raise _wrong(text, f"'{when}' is no time in s")
    if what.lower().endswith((".yaml", ".yml")):
        return Appearance(text, time, _elements_of(what, text))
    place = what.partition("@")[2]
    if not colon or not place:
        raise _wrong(text, "something is missing")
    if kind not in _KINDS:
        raise _wrong(text, f"'{kind}' is none of {', '.join(_KINDS)}")
    element = _element(kind, size, text)
    if place == FOOTHOLD:
        return Appearance(text, time, (element,), on_foothold=True)
    where = _numbers(place)
    if where is None or len(where) not in (2, 3, 4):
        raise _wrong(text, f"'{place}' is no place")
    if len(where) == 2:
        return Appearance(text, time, (element,), on_ground=np.array(where))
    try:
        placed = replace(element, X_WE=pose(where[:3], (0.0, 0.0, *where[3:]) if len(where) == 4 else (0.0, 0.0, 0.0)))
    except UserInputError as error:
        raise UserInputError(f"spawn '{text}': {error}") from None
    return Appearance(text, time, (placed,))


def _element(kind: str, size: str, text: str) -> Element:
    count, names = _KINDS[kind]
    numbers = _numbers(size)
    if numbers is None or len(numbers) != count:
        raise _wrong(text, f"a {kind} needs {kind}:{names}")
    common = {"label": Steppability.NON_PASSABLE, "name": "spawned"}
    try:
        if kind == "box":
            return Box(size=numbers, **common)
        if kind == "cylinder":
            return Cylinder(radius=numbers[0], length=numbers[1], **common)
        return Sphere(radius=numbers[0], **common)
    except UserInputError as error:
        raise UserInputError(f"spawn '{text}': {error}") from None


def _elements_of(path: str, text: str) -> tuple[Element, ...]:
    """The elements of a terrain file, whose start and goal do not matter."""
    try:
        return read_terrain_file(path, start=[0.0, 0.0, 0.0], goal=[0.0, 0.0]).elements
    except UserInputError as error:
        raise UserInputError(f"spawn '{text}': {error}") from None


def _half_height(element: Element) -> float:
    """From the bottom of an upright element to its centre [m]."""
    if isinstance(element, Box):
        return 0.5 * float(element.size[2])
    return 0.5 * element.length if isinstance(element, Cylinder) else float(element.radius)


def _numbers(text: str) -> list[float] | None:
    """Numbers between commas; None if it is anything else."""
    numbers = [_number(word) for word in text.split(",")]
    return None if None in numbers else numbers


def _number(word: str) -> float | None:
    try:
        number = float(word)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _wrong(text: str, problem: str) -> UserInputError:
    return UserInputError(f"spawn '{text}': {problem}; {_RIGHT}")
