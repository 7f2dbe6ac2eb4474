"""A directory for the results of one trial or report: nobody else writes into it, and nothing in it is lost by accident."""

import errno
import json
from pathlib import Path

from filelock import FileLock, Timeout

from quadpips_drake.errors import UserInputError

TRIAL_FILES = (
    *("result.json", "log.npz", "recording.html", "config.yaml", "error.txt"),
    *("report.html", "story.json", "film.mp4", "explain.html", "profile.html", "profile.json"),
    "experience.npz",
)
"""What a trial writes."""
_LOCK = ".lock"


class ResultDirectory:
    """Holds a directory for as long as results are written into it (``with``).

    Entering makes the directory when it is missing, refuses one that holds results (unless they may be overwritten), and
    keeps others out by a lock that the operating system takes back when the process ends, however it ends. Nothing is
    removed before ``clear``.
    """

    def __init__(self, path: Path, names: tuple[str, ...] = TRIAL_FILES, *, overwrite: bool = False):
        """Args: the directory; names of all files that will be written; whether earlier ones may go."""
        self.path, self._names, self._overwrite = Path(path), names, overwrite
        self._lock = FileLock(self.path / _LOCK, timeout=0)
        self._was_made = False

    def __enter__(self) -> "ResultDirectory":
        try:
            self._was_made = not self.path.exists()
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock.acquire()
        except Timeout:
            raise UserInputError(
                f"--out {self.path}: another process is writing its results there; wait for it, or give another directory"
            ) from None
        except OSError as error:
            raise UserInputError(
                f"--out {self.path}: cannot write there ({why(error)}); give a writable directory"
            ) from None
        try:
            self._check()
        except BaseException:
            self._leave()
            raise
        return self

    def __exit__(self, *_):
        self._leave()

    @property
    def is_free(self) -> bool:
        """Whether writing the files would destroy nothing."""
        return not self.present() or _was_refused(self.path)

    def present(self) -> list[str]:
        """Names of the files that are there."""
        return [name for name in self._names if (self.path / name).is_file()]

    def clear(self) -> None:
        """Removes the files of an earlier trial; the new one begins."""
        for name in self.present():
            (self.path / name).unlink()

    def _check(self) -> None:
        for name in self._names:
            path = self.path / name
            if path.exists() and not path.is_file():
                raise UserInputError(f"--out {self.path}: {name} in it is no file; remove it, or give another directory")
        if not self._overwrite and not self.is_free:
            found = self.present()
            raise UserInputError(
                f"--out {self.path}: holds results already ({', '.join(found)}); "
                "add --overwrite to replace them, or give another directory"
            )

    def _leave(self) -> None:
        # Removed while it is held: whoever has opened it meanwhile finds that it is gone, and makes a new one.
        (self.path / _LOCK).unlink(missing_ok=True)
        self._lock.release()
        if self._was_made and not any(self.path.iterdir()):
            self.path.rmdir()


def why(error: OSError) -> str:
    """What the operating system says about a failure, in few words."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return f"{error.strerror}: the disk is full or a limit is reached"
    return error.strerror or str(error) or type(error).__name__


def _was_refused(path: Path) -> bool:
    """Whether the last trial in a directory never began, so that there is only a result.json with the reason."""
    if any((path / name).exists() for name in ("log.npz", "recording.html")):
        return False
    try:
        result = json.loads((path / "result.json").read_text(encoding="utf-8"))
        return result["reason"] == "error" and result["sim_time"] == 0.0
    except (OSError, ValueError, KeyError, TypeError):
        return False
