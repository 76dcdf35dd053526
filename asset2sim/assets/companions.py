"""PartNet-Mobility's files beside a URDF, which say more of the asset: labels of links, and its category."""

import json
from pathlib import Path

from asset2sim.assets.urdf.references import MOST_DESCRIBED, AllowedFolders, lies_outside
from asset2sim.storage.regular_files import NOT_THERE, file_problem, read_regular
from schemas.finding import Finding
from schemas.vocabulary import Severity, Stage

COMPANIONS = ("semantics.txt", "meta.json", "mobility_v2.json")
"""Files that stay true after scaling (its bounding box would not)."""


def companions_of(folder: Path, reach: AllowedFolders) -> tuple[dict[str, Path], list[Finding]]:
    """The files beside the URDF that say more of the asset, by name; a finding for each that cannot be read or lies
    outside, and is left out."""
    found, findings = {name: folder / name for name in COMPANIONS}, []
    for name, path in list(found.items()):
        problem = file_problem(path)
        code = "companion_unusable"
        if problem is None and not reach.allows(path):
            problem, code = lies_outside(path, reach), "outside_dataset"
        if problem is not None:
            del found[name]
        if problem not in (None, NOT_THERE):
            message = f"'{name}' {problem}; it is left out"
            findings.append(Finding(stage=Stage.EXTRACT, severity=Severity.WARNING, code=code, message=message))
    return found, findings


def read_semantics(file: Path | None) -> dict[str, tuple[str, str]]:
    """Link name → (joint kind, label) from ``semantics.txt``, without lines that do not fit; empty without the file."""
    labels: dict[str, tuple[str, str]] = {}
    try:
        text = "" if file is None else read_regular(file, MOST_DESCRIBED).decode("utf-8", errors="replace")
    except OSError:
        return labels
    for line in text.splitlines():
        words = line.split(maxsplit=2)
        if len(words) >= 2:
            labels[words[0]] = (words[1], words[2].strip() if len(words) > 2 else "")
    return labels


def read_category(file: Path | None) -> str:
    """The category that ``meta.json`` states as ``model_cat``, or an empty string."""
    try:
        meta = None if file is None else json.loads(read_regular(file, MOST_DESCRIBED).decode("utf-8"))
    except (OSError, ValueError, RecursionError):
        return ""
    category = meta.get("model_cat") if isinstance(meta, dict) else None
    return category if isinstance(category, str) else ""
