"""PartNet-Mobility's companions of a URDF: link labels and the category."""

import json
from pathlib import Path


def read_semantics(folder: Path) -> dict[str, tuple[str, str]]:
    """Link name → (joint kind, label) from ``semantics.txt``; empty where there is none. Lines that do not fit
    are skipped."""
    file = folder / "semantics.txt"
    if not file.is_file():
        return {}
    labels: dict[str, tuple[str, str]] = {}
    for line in file.read_text(encoding="utf-8", errors="replace").splitlines():
        words = line.split(maxsplit=2)
        if len(words) >= 2:
            labels[words[0]] = (words[1], words[2].strip() if len(words) > 2 else "")
    return labels


def read_category(folder: Path) -> str:
    """The category that ``meta.json`` states as ``model_cat``, or an empty string."""
    file = folder / "meta.json"
    try:
        meta = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ""
    category = meta.get("model_cat") if isinstance(meta, dict) else None
    return category if isinstance(category, str) else ""
