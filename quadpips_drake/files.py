"""Writing files so that a reader never finds half of one."""

import json
from pathlib import Path


def write_json(path: Path, content: dict) -> None:
    """Writes ``content`` to ``path`` at once: whoever reads sees the old file or the new one."""
    unfinished = Path(path).with_name(f".{Path(path).name}.new")
    unfinished.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    unfinished.replace(path)
