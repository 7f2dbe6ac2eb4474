"""Where the sources lie and what is in them, for the tests that look at the project as a whole."""

import importlib
import pkgutil
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import quadpips_drake

ROOT = Path(__file__).resolve().parent.parent
NOT_SOURCES = {".git", ".venv", "out", "build", "dist", "__pycache__", ".pytest_cache", ".ruff_cache", ".benchmarks"}


def files(*patterns: str) -> list[Path]:
    """Files of the project (no results, caches or environments), as absolute paths, whose names match a pattern."""
    return sorted(
        path
        for pattern in patterns
        for path in ROOT.rglob(pattern)
        if path.is_file() and not any(part in NOT_SOURCES for part in path.relative_to(ROOT).parts)
    )


def package_modules() -> Iterator[ModuleType]:
    """Imports and yields every module of the package, diagrams included."""
    # diagrams/ lies beside quadpips_drake/ in an editable installation and is mapped into it, so it is walked by itself.
    for package_name in ("quadpips_drake", "quadpips_drake.diagrams"):
        package = importlib.import_module(package_name)
        for info in pkgutil.walk_packages(package.__path__, package_name + "."):
            yield importlib.import_module(info.name)


def module_name(path: Path) -> str:
    """Dotted name under which a file of quadpips_drake/ or diagrams/ is imported."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    if parts[0] == "diagrams":
        parts = (quadpips_drake.__name__, *parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
