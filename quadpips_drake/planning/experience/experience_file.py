"""Experience on disk: one file, a NumPy archive without pickled objects, whose content is checked before it is used.

It holds the arrays of an ExperienceLibrary and ``header``, JSON with what they belong to and a checksum over both. Files may
come from anywhere; what is wrong with one is said in a line, and such a file is never written over.
"""

import dataclasses
import hashlib
import io
import json
import zipfile
from pathlib import Path

import numpy as np

from quadpips_drake.errors import UserInputError, shown
from quadpips_drake.files import parse_json, read_bytes, write_bytes
from quadpips_drake.planning.experience.experience_config import MAX_RECORDS
from quadpips_drake.planning.experience.learning import RECORD_FIELDS
from quadpips_drake.values.swing_plan import ExperienceLibrary, SwingOutcome

FORMAT, VERSION = "quadpips experience", 1
MAX_BYTES = 25_000_000
"""Larger files are not read [bytes]: MAX_RECORDS of them take half of it."""
_IDENTITY = ("scope", "robot", "configuration", "site")
_HEADER = "header"
_MAX_HEADER = 10_000
_FARTHEST = 1e4
"""No foothold is further away from the origin than this [m]."""
_ADVICE = "give another file, or move it away"
_TITLES = {"scope": "scope", "robot": "robot", "configuration": "configuration of the swings", "site": "terrain"}


def configuration_hash(*configs, **more) -> str:
    """Hash of configurations (dataclasses) and numbers; when a stage computes, and how late it is, does not count."""
    content = [dataclasses.asdict(config) for config in configs]
    for values in content:
        values.pop("rate", None)
        values.pop("latency", None)
    text = json.dumps([*content, more], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def save_library(path: Path, library: ExperienceLibrary) -> None:
    """Writes ``library`` to ``path`` at once; a file that is there must be one of the same kind.

    Raises:
        UserInputError: it is not; it stays as it is.
        OSError: it cannot be written.
    """
    if Path(path).exists():
        load_library(path, library)
    arrays = {name: np.ascontiguousarray(getattr(library, name)) for name in RECORD_FIELDS}
    header = {"format": FORMAT, "version": VERSION, **{key: getattr(library, key) for key in _IDENTITY}}
    header |= {"trials": library.trials, "records": len(library)}
    header["checksum"] = _checksum(header, arrays)
    text = np.frombuffer(json.dumps(header).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez(buffer, **{_HEADER: text}, **arrays)
    write_bytes(path, buffer.getvalue())


def load_library(path: str | Path, like: ExperienceLibrary) -> ExperienceLibrary:
    """Reads the library in the file at ``path``.

    Args:
        path: of the file.
        like: a library with the scope, robot, configuration and site for which it must have been made.

    Raises:
        UserInputError: it is no such file, damaged, or made for something else.
    """
    try:
        header, arrays = _read(read_bytes(path, "", MAX_BYTES))
        for key in _IDENTITY:
            if header.get(key) != getattr(like, key):
                raise UserInputError(f"made for another {_TITLES[key]}, {shown(header.get(key))}")
    except UserInputError as error:
        source = f"experience {path}: "
        text = str(error).removeprefix(f"{path}: ")
        raise UserInputError(f"{source}{text}; {_ADVICE}") from None
    return dataclasses.replace(like, trials=header["trials"], **arrays)


def _read(content: bytes) -> tuple[dict, dict[str, np.ndarray]]:
    """Header and arrays of a file, all of it checked but for what it was made for."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            names = {f"{name}.npy" for name in (_HEADER, *RECORD_FIELDS)}
            members = {member.filename: member for member in archive.infolist()}
            if set(members) != names or len(archive.infolist()) != len(names):
                raise UserInputError("not a library of experience: it holds other arrays")
            for member in members.values():  # nothing is unpacked that is larger than the file
                if member.compress_type != zipfile.ZIP_STORED or member.file_size > len(content):
                    raise UserInputError("not a library of experience: it is packed")
            header = _header(_array(archive.read(f"{_HEADER}.npy"), np.dtype(np.uint8), (None,)))
            arrays = {name: _array(archive.read(f"{name}.npy"), *_kind(name)) for name in RECORD_FIELDS}
    except (zipfile.BadZipFile, EOFError, OSError, ValueError, NotImplementedError, RuntimeError) as error:
        if isinstance(error, UserInputError):
            raise
        raise UserInputError("truncated or damaged, or not a library of experience") from None
    if header.get("checksum") != _checksum(header, arrays):
        raise UserInputError("damaged: its checksum is another one")
    _check(header, arrays)
    return header, arrays


def _kind(name: str) -> tuple[np.dtype, tuple]:
    """Type and shape of an array; None: as many as there are records."""
    example = getattr(ExperienceLibrary.empty(), name)
    return example.dtype, (None, *example.shape[1:])


def _array(content: bytes, dtype: np.dtype, shape: tuple) -> np.ndarray:
    """The array in a .npy file; its header must say what is there and what is expected."""
    stream = io.BytesIO(content)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError("of another version of the format of arrays")
    found, in_columns, kind = np.lib.format.read_array_header_1_0(stream)
    size = len(content) - stream.tell()
    if kind != dtype or in_columns or len(found) != len(shape) or found[1:] != shape[1:]:
        raise ValueError("an array of another kind")
    if found[0] > size or int(np.prod(found)) * dtype.itemsize != size:
        raise ValueError("an array of another size")
    return np.frombuffer(content, dtype, offset=stream.tell()).reshape(found)


def _header(content: np.ndarray) -> dict:
    if len(content) > _MAX_HEADER:
        raise UserInputError("not a library of experience: its header is too long")
    header = parse_json(content.tobytes().decode(), "header")
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise UserInputError("not a library of experience")
    if header.get("version") != VERSION:
        raise UserInputError(f"of version {shown(header.get('version'))}; version {VERSION} can be read")
    return header


def _checksum(header: dict, arrays: dict[str, np.ndarray]) -> str:
    """SHA-256 of all but the checksum itself."""
    digest = hashlib.sha256(json.dumps({k: v for k, v in header.items() if k != "checksum"}, sort_keys=True).encode())
    for name in RECORD_FIELDS:
        digest.update(arrays[name].tobytes())
    return digest.hexdigest()


def _check(header: dict, arrays: dict[str, np.ndarray]) -> None:
    """Whether the content makes sense; a right checksum says nothing about who made it."""
    n, trials = len(arrays["count"]), header.get("trials")
    if n > MAX_RECORDS:
        raise UserInputError(f"too large: {n} records, at most {MAX_RECORDS}")
    if any(len(array) != n for array in arrays.values()) or header.get("records") != n:
        raise UserInputError("damaged: its arrays differ in length")
    if not isinstance(trials, int) or isinstance(trials, bool) or trials < 0:
        raise UserInputError("damaged: its number of trials is no number")
    if not all(np.isfinite(arrays[name]).all() for name in ("before", "after", "cost")):
        raise UserInputError("holds numbers that are not finite")
    if any(np.abs(arrays[name]).max(initial=0.0) > _FARTHEST for name in ("before", "after")):
        raise UserInputError(f"holds footholds that are more than {_FARTHEST:g} m away")
    least = {"count": 1, "cost": 0, "legs": 1, "phase": 0, "status": 0, "last": 0}
    most = {"legs": 15, "status": max(SwingOutcome), "last": trials, "count": 10**12}
    for name, low in least.items():
        if n and (arrays[name].min() < low or arrays[name].max() > most.get(name, np.inf)):
            raise UserInputError(f"holds a wrong {name}")
