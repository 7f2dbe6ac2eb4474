"""The journal of a bench: a line of JSON for each trial that is over, added at the end and on the disk before the next one.

Whatever ends the program, what was added stays. A line that was being written then is torn; it is dropped when the journal
is opened again, and its trial counts as not run.
"""

import json
import os
from contextlib import suppress
from pathlib import Path

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import parse_json, read_bytes

MAX_JOURNAL_BYTES = 4_000_000_000
"""Largest journal that is read [bytes]; a trial takes some 10 kB."""


class Journal:
    """Entries by key, in a file that only grows; a context manager that closes it."""

    def __init__(self, path: Path):
        """Opens the journal at ``path``, a new one if there is none.

        Raises:
            UserInputError: it cannot be read or written, or a line in it that is not the last one is damaged.
        """
        self.path = Path(path)
        self.entries, whole, self.remarks = read_journal(self.path)
        """``entries`` by key, in the order in which they came; ``remarks``: what was wrong with the file, for the user."""
        try:
            self._file = self.path.open("ab")
            if self._file.tell() > whole:
                self._file.truncate(whole)
            _sync_folder(self.path.parent)
        except OSError as error:
            raise UserInputError(f"{self.path}: cannot write there ({error.strerror})") from None

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_):
        self._file.close()

    def append(self, key: str, entry: dict) -> None:
        """Adds an entry under a new key; when this returns it is on the disk.

        Raises:
            UserInputError: it could not be written, because the disk is full, say; the journal is as before.
        """
        if key in self.entries:
            raise ValueError(f"{key} has an entry already")
        line = json.dumps({"key": key, **entry}, separators=(",", ":")).encode() + b"\n"
        before = os.fstat(self._file.fileno()).st_size
        try:
            self._file.write(line)
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            self._forget(before)
            raise UserInputError(f"{self.path}: cannot write there ({error.strerror})") from None
        self.entries[key] = entry

    def _forget(self, size: int) -> None:
        """Cuts the file back; whatever of the last line is still in Python's buffer goes with the file object."""
        descriptor = os.dup(self._file.fileno())
        with suppress(OSError):
            self._file.close()
        os.ftruncate(descriptor, size)
        self._file = os.fdopen(descriptor, "ab")


def read_journal(path: Path) -> tuple[dict[str, dict], int, list[str]]:
    """Reads a journal without changing it.

    Returns: its entries by key; the length of what is whole of the file [bytes]; remarks for the user.

    Raises:
        UserInputError: it cannot be read, or a line that is not the last one is damaged.
    """
    entries: dict[str, dict] = {}
    if not path.exists():
        return entries, 0, []
    lines = read_bytes(path, max_bytes=MAX_JOURNAL_BYTES).split(b"\n")
    whole, remarks = 0, []
    last = len(lines) if lines[-1] else len(lines) - 1
    for number, line in enumerate(lines[:last], start=1):
        entry = _entry(line) if number < len(lines) else None  # without its line end it is not whole
        if entry is None and number == last:
            remarks.append(f"{path}: the last line was torn and is dropped; its trial is run again")
            break
        if entry is None:
            raise UserInputError(f"{path}: line {number} is damaged; remove that line, and its trial is run again")
        whole += len(line) + 1
        key = entry.pop("key")
        if key in entries:
            remarks.append(f"{path}: line {number} is a second entry for {key}; the first one counts")
        entries.setdefault(key, entry)
    return entries, whole, remarks


def _entry(line: bytes) -> dict | None:
    """What stands in a line; None if it is no entry."""
    try:
        entry = parse_json(line.decode(), "journal")
    except (UserInputError, UnicodeDecodeError):
        return None
    return entry if isinstance(entry, dict) and isinstance(entry.get("key"), str) else None


def _sync_folder(folder: Path) -> None:
    """Sees to it that the name of a new file in ``folder`` is on the disk, too."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
