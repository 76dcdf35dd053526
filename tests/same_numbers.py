"""Compare two outputs of ``refine``: ``python -m tests.same_numbers OLD NEW`` prints each difference; exits 1 if any.

Compared are every asset's folder (URDF and other XML element by element, JSON value by value, all else by content,
without pictures and checksums) and every table of the catalog, without what differs from run to run: times, ids,
versions, hashes and places. What only one side has of tables and columns is listed and is no difference.
"""

import json
import math
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pyarrow.parquet as pq

from schemas.tables import TABLES

LEFT_OUT_FILES = {"SHA256SUMS"}
"""Files that follow from the others."""
PICTURES = {".png", ".jpg", ".jpeg", ".webp"}
"""Endings of files that are not compared in ``views``: text and textures of an asset itself are."""
XML = {".urdf", ".sdf", ".xml", ".mjcf"}
LEFT_OUT_COLUMNS = {
    *("run_id", "started_at", "finished_at", "asset_seconds", "latency_s", "cached", "cached_calls"),
    *("engine_version", "git_commit", "git_dirty", "versions_json", "content_hash", "prompt_hash", "answer_file"),
    *("dataset", "source_path"),
}
"""Columns that differ from run to run, beside those whose name begins with ``seconds`` or ``processor_s``. Whether an
answer came from the cache depends on what ran before."""
LEFT_OUT_SETTINGS = ("run.workers", "run.hook")
"""Settings that say how a run is spread, not what it computes."""


class Difference(NamedTuple):
    """One value that differs: the asset (or run), the file or table, the place in it, and both values."""

    asset: str
    file: str
    where: str
    old: object
    new: object


def differences(old: Path, new: Path) -> Iterator[Difference]:
    """Every difference between two outputs."""
    yield from folder_differences(old / "assets", new / "assets")
    for name in TABLES:
        one, other = (out / "catalog" / f"{name}.parquet" for out in (old, new))
        if one.is_file() and other.is_file():
            yield from table_differences(name, one, other)


def folder_differences(old: Path, new: Path) -> Iterator[Difference]:
    """Every difference between the assets' folders."""
    for asset in sorted(_names(old) | _names(new)):
        before, after = _files(old / asset), _files(new / asset)
        for file in sorted(before.keys() | after.keys()):
            if file not in before or file not in after:
                yield Difference(asset, file, "", *("there" if file in side else "absent" for side in (before, after)))
            else:
                for where, *values in file_differences(before[file], after[file]):
                    yield Difference(asset, file, where, *values)


def file_differences(old: Path, new: Path) -> Iterator[tuple[str, object, object]]:
    """Place, old and new value of each difference between two files."""
    one, other = old.read_bytes(), new.read_bytes()
    if one == other:
        return
    if old.suffix == ".json":
        yield from value_differences(_leaves(json.loads(one)), _leaves(json.loads(other)))
    elif old.suffix in XML:
        yield from value_differences(_attributes(ET.fromstring(one)), _attributes(ET.fromstring(other)))
    else:
        yield "content", f"{len(one)} bytes", f"{len(other)} bytes"


def table_differences(name: str, old: Path, new: Path) -> Iterator[Difference]:
    """Every difference between two files of one table, in the columns that both have."""
    one, other = pq.read_table(old), pq.read_table(new)
    columns = [column for column in one.schema.names if column in other.schema.names and not _left_out(column)]
    key = [column for column in TABLES[name].key if column != "run_id"]
    before, after = ({_key(row, key): row for row in table.to_pylist()} for table in (one, other))
    for item in sorted(before.keys() | after.keys(), key=str):
        asset, where = (str(item[0]), " ".join(map(str, item[1:]))) if item else ("", "")
        if item not in before or item not in after:
            yield Difference(asset, name, where, *("row" if item in side else "no row" for side in (before, after)))
            continue
        for column in columns:
            values = (_value(column, before[item][column]), _value(column, after[item][column]))
            for place, *found in value_differences(*map(_leaves, values), both=column == "settings_json"):
                yield Difference(asset, name, f"{where} {column}{place}".strip(), *found)


def value_differences(
    old: dict[str, object], new: dict[str, object], *, both: bool = False
) -> Iterator[tuple[str, object, object]]:
    """Place, old and new value where two flat records differ; ``both``: only at places that both have."""
    for place in old.keys() & new.keys() if both else dict.fromkeys([*old, *new]):
        one, other = old.get(place, "absent"), new.get(place, "absent")
        nan = isinstance(one, float) and isinstance(other, float) and math.isnan(one) and math.isnan(other)
        if one != other and not nan and not place.removeprefix(".").startswith(LEFT_OUT_SETTINGS):
            yield place, one, other


def one_sided(old: Path, new: Path) -> Iterator[str]:
    """A line for each table and column that only one output has."""
    for name in sorted({file.stem for out in (old, new) for file in (out / "catalog").glob("*.parquet")}):
        columns = []
        for out in (old, new):
            file = out / "catalog" / f"{name}.parquet"
            columns.append(set(pq.read_schema(file).names) if file.is_file() else set[str]())
        if not all(columns):
            yield f"table {name} only in {old if columns[0] else new}"
        else:
            yield from (f"{name}.{column} only in {old}" for column in sorted(columns[0] - columns[1]))
            yield from (f"{name}.{column} only in {new}" for column in sorted(columns[1] - columns[0]))


def _names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} if folder.is_dir() else set()


def _files(folder: Path) -> dict[str, Path]:
    """Path within the asset's folder → each file that is compared."""
    found = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    shown = {name for name in found if name.startswith("views/") and Path(name).suffix in PICTURES}
    return {name: path for name, path in found.items() if name not in LEFT_OUT_FILES | shown}


def _attributes(element: ET.Element, place: str = "") -> dict[str, object]:
    """Place → tag, attribute or text of every element; numbers as numbers."""
    here = f"{place}/{element.tag}" + (f"[{element.get('name')}]" if element.get("name") else "")
    found: dict[str, object] = {here: "element", f"{here} text": _numbers(element.text or "")}
    found |= {f"{here}@{name}": _numbers(value) for name, value in element.attrib.items()}
    for index, child in enumerate(element):
        found |= _attributes(child, f"{here}/{index}")
    return found


def _numbers(text: str) -> tuple[object, ...]:
    """Words of a text, as floats where they are: ``1.0`` is ``1``."""
    words: list[object] = []
    for word in text.split():
        try:
            words.append(float(word))
        except ValueError:
            words.append(word)
    return tuple(words)


def _leaves(value: object, place: str = "") -> dict[str, object]:
    """Place → each value in nested JSON that is neither a list nor an object; empty ones included."""
    parts = (
        value.items() if isinstance(value, dict) else list(enumerate(value)) if isinstance(value, (list, tuple)) else ()
    )
    if not parts:
        return {place: value}
    return {where: leaf for name, part in parts for where, leaf in _leaves(part, f"{place}.{name}").items()}


def _value(column: str, value: object) -> object:
    return json.loads(value) if column.endswith("_json") and isinstance(value, str) else value


def _key(row: dict[str, object], columns: list[str]) -> tuple[object, ...]:
    return tuple(row[column] for column in columns)


def _left_out(column: str) -> bool:
    return column in LEFT_OUT_COLUMNS or column.startswith(("seconds", "processor_s"))


def main(old: Path, new: Path) -> int:
    """Print what differs; 1 where anything does, or where there is nothing to compare."""
    if not _names(old / "assets") and not (old / "catalog").is_dir():
        print(f"{old}: no output of refine")
        return 1
    for line in one_sided(old, new):
        print(line)
    found = list(differences(old, new))
    for item in found:
        print(f"{item.asset or 'run'}: {item.file}: {item.where}: {item.old!r} → {item.new!r}")
    print(f"{len(found)} differences")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:3])))
