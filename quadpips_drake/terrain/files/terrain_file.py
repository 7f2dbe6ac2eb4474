"""Terrain files: YAML in and out.

A file holds `name`, `start` [x, y, yaw], `goal` [x, y], `friction`, and lists `boxes` (size, xyz, rpy), `cylinders`
(radius, length, xyz, rpy), `spheres` (radius, xyz) and `meshes` (path of an .obj file relative to the YAML file, scale, xyz,
rpy); an element may have a `name` and a `label`. Files come from anywhere, so everything is checked, and what is wrong is
said with file, key and reason.
"""

import math
from pathlib import Path

import numpy as np
import yaml

from quadpips_drake.errors import UserInputError
from quadpips_drake.plain_yaml import read_yaml
from quadpips_drake.terrain.files.mesh_file import read_obj
from quadpips_drake.terrain.terrain import (
    DEFAULT_FRICTION,
    MAX_ELEMENTS,
    Box,
    Cylinder,
    Element,
    Mesh,
    Sphere,
    Terrain,
    pose,
)
from quadpips_drake.values.steppability import Steppability

MAX_NAME_LENGTH = 100
LABELS = {label.name.lower(): label for label in Steppability}

_COMMON_KEYS = {"name", "label", "xyz", "rpy"}
_ELEMENT_KEYS = {"boxes": {"size"}, "cylinders": {"radius", "length"}, "spheres": {"radius"}, "meshes": {"path", "scale"}}
_TOP_KEYS = {"name", "start", "goal", "friction", *_ELEMENT_KEYS}


def read_terrain_file(path: str | Path, start=None, goal=None) -> Terrain:
    """Reads a YAML terrain; ``start`` (x, y, yaw) and ``goal`` (x, y), when given, replace those in the file."""
    data = read_yaml(path, f"terrain file '{path}'")
    return _FileReader(path).terrain(data, start, goal)


def write_terrain_file(terrain: Terrain, path: str | Path):
    """Writes ``terrain`` as YAML; ``read_terrain_file`` returns the same terrain. Meshes are named by absolute path."""
    data = {
        "name": terrain.name,
        "start": _numbers(terrain.start),
        "goal": _numbers(terrain.goal),
        "friction": float(terrain.friction),
    }
    for element in terrain.elements:
        key, entry = _element_entry(element)
        data.setdefault(key, []).append(entry)
    text = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=120)
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise UserInputError(f"cannot write '{path}': {error.strerror}") from None


def _numbers(values) -> list[float]:
    # 12 decimals are 1e-12 m; fewer digits keep files readable (0.3 instead of 0.30000000000000004).
    return [round(float(value), 12) + 0.0 for value in values]


def _element_entry(element: Element) -> tuple[str, dict]:
    entry = {"name": element.name} if element.name else {}
    if isinstance(element, Box):
        key = "boxes"
        entry["size"] = _numbers(element.size)
    elif isinstance(element, Cylinder):
        key = "cylinders"
        entry |= {"radius": float(element.radius), "length": float(element.length)}
    elif isinstance(element, Sphere):
        key = "spheres"
        entry["radius"] = float(element.radius)
    else:
        key = "meshes"
        if not element.path:
            raise UserInputError(f"{element.title}: a mesh without a file cannot be written to a terrain file")
        entry |= {"path": str(Path(element.path).resolve()), "scale": float(element.scale)}
    entry |= {"xyz": _numbers(element.X_WE[:3, 3]), "rpy": _numbers(element.rpy)}
    if element.label != Steppability.STEPPABLE:
        entry["label"] = element.label.name.lower()
    return key, entry


class _FileReader:
    """Turns parsed YAML into a Terrain; knows the file for messages."""

    def __init__(self, path):
        self.path = path

    def error(self, key: str, reason: str) -> UserInputError:
        return UserInputError(f"terrain file '{self.path}': {key}: {reason}")

    def terrain(self, data, start, goal) -> Terrain:
        if not isinstance(data, dict):
            raise self.error("the file", f"must be a mapping with the keys {', '.join(sorted(_TOP_KEYS))}")
        self.check_keys("the file", data, _TOP_KEYS)
        start = data.get("start") if start is None else start
        goal = data.get("goal") if goal is None else goal
        for key, value, meaning in (("start", start, "[x, y, yaw]"), ("goal", goal, "[x, y]")):
            if value is None:
                raise self.error(key, f"missing; write '{key}: {meaning}' or give --{key}")
        elements = []
        for kind in _ELEMENT_KEYS:
            elements += self.elements(kind, data.get(kind, []), MAX_ELEMENTS - len(elements))
        if not elements:
            raise self.error("boxes", "no boxes, cylinders, spheres or meshes: there is nothing to stand on")
        name = self.text("name", data.get("name", Path(self.path).stem))
        friction = self.number("friction", data.get("friction", DEFAULT_FRICTION))
        start, goal = self.vector("start", start, 3), self.vector("goal", goal, 2)
        try:
            return Terrain(name, start, goal, friction, tuple(elements))
        except UserInputError as error:
            raise UserInputError(f"terrain file '{self.path}': {error}") from None

    def elements(self, kind: str, entries, room: int) -> list[Element]:
        if entries is None:
            return []
        if not isinstance(entries, list):
            raise self.error(kind, "must be a list")
        if len(entries) > room:
            raise self.error(kind, f"more than {MAX_ELEMENTS} elements in all")
        return [self.element(f"{kind}[{i}]", kind, entry) for i, entry in enumerate(entries)]

    def element(self, key: str, kind: str, entry) -> Element:
        own_keys = _ELEMENT_KEYS[kind]
        if not isinstance(entry, dict):
            raise self.error(key, f"must be a mapping with the keys {', '.join(sorted(own_keys | _COMMON_KEYS))}")
        self.check_keys(key, entry, own_keys | _COMMON_KEYS)
        for needed in [*sorted(own_keys - {"scale"}), "xyz"]:
            if needed not in entry:
                raise self.error(f"{key}.{needed}", "missing")
        common = {
            "X_WE": pose(
                self.vector(f"{key}.xyz", entry["xyz"], 3), self.vector(f"{key}.rpy", entry.get("rpy", [0] * 3), 3)
            ),
            "label": self.label(f"{key}.label", entry.get("label", "steppable")),
            "name": self.text(f"{key}.name", entry.get("name", "")),
        }
        try:
            if kind == "boxes":
                return Box(size=self.vector(f"{key}.size", entry["size"], 3), **common)
            if kind == "cylinders":
                radius, length = (self.number(f"{key}.{name}", entry[name]) for name in ("radius", "length"))
                return Cylinder(radius=radius, length=length, **common)
            if kind == "spheres":
                return Sphere(radius=self.number(f"{key}.radius", entry["radius"]), **common)
            return self.mesh(key, entry, common)
        except UserInputError as error:
            if str(error).startswith("terrain file"):
                raise
            raise self.error(key, str(error)) from None

    def mesh(self, key: str, entry: dict, common: dict) -> Mesh:
        path = Path(self.path).parent / self.text(f"{key}.path", entry["path"], 4096)
        scale = self.number(f"{key}.scale", entry.get("scale", 1.0))
        if not 1e-6 <= scale <= 1e6:
            raise self.error(f"{key}.scale", "must be between 1e-6 and 1e6")
        try:
            vertices, triangles = read_obj(path)
        except UserInputError as error:
            raise self.error(f"{key}.path", str(error)) from None
        return Mesh(vertices=scale * vertices, triangles=triangles, path=str(path), scale=scale, **common)

    def check_keys(self, key: str, mapping: dict, known: set):
        for name in mapping:
            if name not in known:
                raise self.error(key, f"unknown key '{str(name)[:60]}'; known: {', '.join(sorted(known))}")

    def number(self, key: str, value) -> float:
        # YAML 1.1 reads 1e-3 as text: accept text that is a number. True and False are ints in Python: refuse them.
        try:
            number = math.nan if isinstance(value, bool) or not isinstance(value, int | float | str) else float(value)
        except (ValueError, OverflowError):
            number = math.nan
        if not math.isfinite(number):
            raise self.error(key, f"must be a finite number, not {_short(value)}")
        return number

    def vector(self, key: str, value, length: int) -> np.ndarray:
        if not isinstance(value, list | tuple | np.ndarray) or len(value) != length:
            raise self.error(key, f"must be a list of {length} numbers, not {_short(value)}")
        return np.array([self.number(f"{key}[{i}]", item) for i, item in enumerate(value)])

    def text(self, key: str, value, max_length: int = MAX_NAME_LENGTH) -> str:
        if not isinstance(value, str) or len(value) > max_length or not value.isprintable():
            raise self.error(key, f"must be printable text of at most {max_length} characters, not {_short(value)}")
        return value

    def label(self, key: str, value) -> Steppability:
        if not isinstance(value, str) or value not in LABELS:
            raise self.error(key, f"unknown label {_short(value)}; known: {', '.join(LABELS)}")
        return LABELS[value]


def _short(value) -> str:
    """A short picture of a wrong value for a message; never the whole of a huge one."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if isinstance(value, int) and abs(value) > 10**18:
        return "a huge integer"
    text = str(value)
    return f"'{text[:40]}...'" if len(text) > 40 else f"'{text}'"
