"""Files in and out: whoever writes leaves no half of one, whoever reads is safe from any content.

Files that users give come from anywhere. They are read as UTF-8 text of bounded size, from regular files only (a pipe
could block and a device never end), and data in them is bounded in depth and number of values. Whatever is wrong becomes
one UserInputError. YAML is read by ``plain_yaml``.
"""

import errno
import json
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from quadpips_drake.errors import UserInputError

MAX_BYTES = 5_000_000
"""Largest file of text that is read [bytes]."""
MAX_DEPTH = 32
"""Deepest nesting of lists and mappings in a file."""
MAX_VALUES = 300_000
"""Most values in a file, keys and lists counted too."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Gives the path of a new file that takes the place of ``path`` at once when the block ends well.

    Whoever reads sees the old file or the new one. When the block raises (a full disk, say) the new file is removed and
    the old one stays.
    """
    path = Path(path)
    unfinished = path.with_name(f".new.{path.name}")
    try:
        yield unfinished
        unfinished.replace(path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


def write_text(path: Path, text: str) -> None:
    """Writes ``text`` (UTF-8) to ``path`` at once, see ``replacing``."""
    with replacing(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8")


def write_json(path: Path, content: dict) -> None:
    """Writes ``content`` to ``path`` at once, see ``replacing``."""
    write_text(path, json.dumps(content, indent=1) + "\n")


def write_bytes(path: Path, content: bytes) -> None:
    """Writes ``content`` to ``path`` at once, see ``replacing``."""
    with replacing(path) as unfinished:
        unfinished.write_bytes(content)


def read_bytes(path: str | Path, source: str = "", max_bytes: int = MAX_BYTES) -> bytes:
    """Returns what is in the file at ``path``.

    Args:
        path: of a regular file.
        source: what the file is called in messages; its path by default.
        max_bytes: largest size [bytes].

    Raises:
        UserInputError: there is no such file, or it is not a regular file, too large or not readable.
    """
    source = source or str(path)
    try:
        data = _read_regular_file(path, max_bytes + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        why = "no such file" if getattr(error, "errno", None) == errno.ENOENT else getattr(error, "strerror", None) or error
        raise UserInputError(f"{source}: {why}") from None
    if data is None:
        raise UserInputError(f"{source}: not a regular file")
    if len(data) > max_bytes:
        raise UserInputError(f"{source}: larger than {max_bytes / 1e6:g} MB")
    return data


def read_text(path: str | Path, source: str = "", max_bytes: int = MAX_BYTES) -> str:
    """Returns the text in the file at ``path``; arguments and errors as those of ``read_bytes``.

    Raises:
        UserInputError: also when it is not UTF-8 text.
    """
    source = source or str(path)
    data = read_bytes(path, source, max_bytes)
    if b"\0" in data:
        raise UserInputError(f"{source}: not UTF-8 text (it has a NUL byte)")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UserInputError(f"{source}: not UTF-8 text (byte {error.start})") from None


def read_json(path: str | Path, source: str = "", max_bytes: int = MAX_BYTES) -> Any:
    """Returns the plain data in a JSON file; arguments and errors as those of ``read_text``, and of ``parse_json``."""
    return parse_json(read_text(path, source, max_bytes), source or str(path))


def parse_json(text: str, source: str) -> Any:
    """Returns the plain data in JSON ``text`` from ``source``; NaN and Infinity count as numbers, as json.dump writes them.

    Raises:
        UserInputError: it is not JSON, a key stands twice, or it is too deep, too much, or holds integers beyond 64 bits.
    """
    try:
        data = json.loads(text, parse_int=_parse_int, object_pairs_hook=_unique_keys)
    except json.JSONDecodeError as error:
        raise UserInputError(f"{source}: line {error.lineno}: not valid JSON: {error.msg}") from None
    except RecursionError:
        raise UserInputError(f"{source}: not valid JSON: nested more than {MAX_DEPTH} deep") from None
    except ValueError as error:
        raise UserInputError(f"{source}: not valid JSON: {error}") from None
    for count, depth in enumerate(_depths(data), start=1):
        if count > MAX_VALUES:
            raise UserInputError(f"{source}: holds more than {MAX_VALUES} values")
        if depth > MAX_DEPTH:
            raise UserInputError(f"{source}: not valid JSON: nested more than {MAX_DEPTH} deep")
    return data


def check_int(value: int) -> int:
    """Returns ``value``; a ValueError if it does not fit into 64 bits, which compiled code computes with."""
    if not -(2**63) <= value < 2**63:
        raise ValueError("a whole number beyond 64 bits")
    return value


def _read_regular_file(path: str | Path, size: int) -> bytes | None:
    """Returns the first ``size`` bytes; None if it is no regular file."""
    if not stat.S_ISREG(os.stat(path).st_mode):  # before it is opened: opening a device may do something
        return None
    # It may have been replaced by a pipe since: without O_NONBLOCK, opening one waits for a writer.
    with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
        return file.read(size) if stat.S_ISREG(os.fstat(file.fileno()).st_mode) else None


def _parse_int(text: str) -> int:
    if len(text) > 20:  # Python refuses to convert 5,000 digits
        raise ValueError("a whole number beyond 64 bits")
    return check_int(int(text))


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict:
    data = dict(pairs)
    if len(data) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key '{next(key for key in keys if keys.count(key) > 1)[:60]}' appears twice")
    return data


def _depths(data: Any) -> Iterator[int]:
    """Yields the depth of each value in ``data``, without recursion."""
    waiting = [(data, 1)]
    while waiting:
        value, depth = waiting.pop()
        yield depth
        if isinstance(value, dict | list):
            waiting += [(item, depth + 1) for item in (value.values() if isinstance(value, dict) else value)]
