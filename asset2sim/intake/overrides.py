"""Numbers of the user's own: ``overrides.csv`` in a dataset's folder, and the manifest's columns of the same names."""

import difflib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from asset2sim.guidance.tables import materials
from asset2sim.intake.table_file import MAX_TABLE_BYTES, Columns, read_rows
from asset2sim.storage.regular_files import path_problem
from asset2sim.storage.tree import Tree
from schemas.asset import AssetRef, Overrides, StatedPosition
from schemas.errors import Mistakes, UsageError
from schemas.support import SupportKind

FILE = "overrides.csv"
NUMBERS = ("scale", "size_m", "mass_kg")
JOINT, MATERIAL = PREFIXES = "joint:", "material:"
WORDS = ("support", "prompt")
"""Columns of ``overrides.csv`` that a manifest has anyway."""
_POSITION = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(%|deg|°|rad|m)?")
_UNITS = {None: "", "%": "share", "deg": "deg", "°": "deg", "rad": "rad", "m": "m"}


def is_override(column: str) -> bool:
    """Whether a manifest's column states numbers of the user's own."""
    return column in NUMBERS or any(column.startswith(kind) and column != kind for kind in (JOINT, MATERIAL))


def nearest(name: str, known: Iterable[str]) -> str:
    """Text that suggests the likeliest meant of the known names, for the end of a message; empty without one."""
    found = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"; did you mean '{found[0]}'?" if found else ""


def read_overrides(cells: Mapping[str, str | None], where: str) -> Overrides | None:
    """The numbers in one row, by column; None without any. Raises UsageError, with ``where`` and the columns, for all
    that is no number or cannot be."""
    stated = {
        name: cell.strip() for name, cell in cells.items() if name and cell and is_override(name) and cell.strip()
    }
    if not stated:
        return None
    mistakes, numbers = Mistakes(), dict[str, float]()
    joints, made_of = dict[str, StatedPosition](), dict[str, str]()
    for name, cell in stated.items():
        place = f"{where}, column '{name}'"
        with mistakes:
            if name.startswith(JOINT):
                joints[name.removeprefix(JOINT)] = _position(cell, place)
            elif name.startswith(MATERIAL):
                made_of[name.removeprefix(MATERIAL)] = _material(cell, place)
            else:
                numbers[name] = _positive(cell, place)
    with mistakes:
        if {"scale", "size_m"} <= stated.keys():
            raise UsageError(f"{where}: columns 'scale' and 'size_m' both say how large it is; leave one empty")
    mistakes.end()
    return Overrides(**numbers, joints=joints, materials=made_of, where=dict.fromkeys(stated, where))


def with_overrides(tree: Tree, refs: Sequence[AssetRef], mistakes: Mistakes, *, whole: bool = True) -> list[AssetRef]:
    """The assets with what the dataset's ``overrides.csv`` says of them; it goes before the manifest's own columns.
    ``mistakes`` get what names line and column, also for an asset that is not there if they are the ``whole``
    dataset."""
    if FILE not in tree.files(""):
        return list(refs)
    known, place = {ref.asset_id: ref for ref in refs}, str(tree.at(FILE))
    columns = Columns(("asset_id",), ("asset_id", *NUMBERS, *WORDS), PREFIXES, prose=("prompt",))
    try:
        content = tree.read(FILE, MAX_TABLE_BYTES + 1)
    except OSError as error:
        raise UsageError(f"{place}: it {path_problem(Path(place), error)}") from error
    lines: dict[str, int] = {}
    for line, row in read_rows(content, place, columns, mistakes):
        where, asset_id = f"{place}, line {line}", row.get("asset_id", "")
        if asset_id not in known and not whole:
            continue
        with mistakes:
            if asset_id not in known:
                raise UsageError(f"{where}: the dataset has no asset '{asset_id}'{nearest(asset_id, known)}")
            if asset_id in lines:
                raise UsageError(f"{where}: asset '{asset_id}' stands in line {lines[asset_id]} already; keep one row")
            lines[asset_id] = line
            known[asset_id] = _overridden(known[asset_id], row, where)
    return [known[ref.asset_id] for ref in refs]


def with_prompt(refs: Sequence[AssetRef], prompt: str | None) -> list[AssetRef]:
    """The one asset with the prompt that the command line states. Raises UsageError where there are several."""
    if prompt is None:
        return list(refs)
    if len(refs) != 1:
        raise UsageError(
            f"--prompt is for one asset, and these are {len(refs)}: choose one by --assets, or write a column 'prompt' "
            f"into manifest.csv or {FILE}"
        )
    return [refs[0].model_copy(update={"prompt": prompt.strip() or None})]


def _overridden(ref: AssetRef, row: Mapping[str, str | None], where: str) -> AssetRef:
    mistakes, update = Mistakes(), dict[str, object]()
    with mistakes:
        if (stated := read_overrides(row, where)) is not None:
            update["overrides"] = stated if ref.overrides is None else _merged(ref.overrides, stated)
    if prompt := (row.get("prompt") or "").strip():
        update["prompt"] = prompt
    with mistakes:
        if support := (row.get("support") or "").strip():
            if support not in list(SupportKind):
                known = ", ".join(SupportKind)
                raise UsageError(
                    f"{where}, column 'support': '{support}' is none of {known}{nearest(support, SupportKind)}"
                )
            update["support"] = SupportKind(support)
    mistakes.end()
    return ref.model_copy(update=update)


def _merged(below: Overrides, above: Overrides) -> Overrides:
    """Both as one; where both state a number, ``above`` has it, and its size replaces either word for the size."""
    found = below.model_dump(exclude_none=True)
    over = above.model_dump(exclude_none=True)
    if {"scale", "size_m"} & over.keys():
        found = {name: value for name, value in found.items() if name not in ("scale", "size_m")}
    nested = {name: {**found.get(name, {}), **over[name]} for name in ("joints", "materials", "where")}
    return Overrides.model_validate({**found, **over, **nested})


def _positive(cell: str, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        raise UsageError(f"{where}: '{cell}' is not a number; write it without a unit, as in 0.35") from None
    if not (math.isfinite(value) and value > 0.0):
        raise UsageError(f"{where}: '{cell}' cannot be; it must be above 0")
    return value


def _position(cell: str, where: str) -> StatedPosition:
    if cell.lower() in ("open", "closed"):
        return StatedPosition(value=float(cell.lower() == "open"), unit="share")
    found = _POSITION.fullmatch(cell.lower())
    if found is None or not math.isfinite(float(found.group(1))):
        raise UsageError(
            f"{where}: '{cell}' is no position; write a number (rad, or m of the refined object), 30deg, a share such "
            f"as 50%, open or closed{nearest(cell.lower(), ('open', 'closed'))}"
        )
    value, unit = float(found.group(1)), _UNITS[found.group(2)]
    if unit == "share" and not 0.0 <= value <= 100.0:
        raise UsageError(f"{where}: '{cell}' cannot be; a joint is 0% (closed) to 100% open")
    return StatedPosition.model_validate({"value": value / 100.0 if unit == "share" else value, "unit": unit})


def _material(cell: str, where: str) -> str:
    if cell.lower() not in materials():
        raise UsageError(
            f"{where}: no material is known as '{cell}'{nearest(cell.lower(), materials())}; choose from: "
            f"{', '.join(materials())}"
        )
    return cell.lower()
