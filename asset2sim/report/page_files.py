"""Pages from templates, and files that are written only where they differ."""

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

from jinja2 import Environment, FileSystemBytecodeCache, PackageLoader, StrictUndefined
from markupsafe import Markup

from asset2sim.catalog.text import duration, significant
from asset2sim.report.charts import count_in_words
from asset2sim.storage.objects import cache_root
from asset2sim.storage.regular_files import write_whole
from schemas.errors import printable

FOLDER = "report"
"""Folder of the report, relative to OUT."""


def page_path(asset_id: str) -> str:
    """Address of an asset's page, relative to the report's folder."""
    return f"objects/{quote(asset_id, safe='')}/index.html"


def write_text(path: Path, text: str) -> None:
    """Write a file in one step; one that is the same stays."""
    content = printable(text).encode("utf-8", "replace")
    if path.is_file() and path.stat().st_size == len(content) and path.read_bytes() == content:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, content)


def source(name: str) -> str:
    """The text of a file beside the templates."""
    return (Path(__file__).parent / "templates" / name).read_text(encoding="utf-8")


def render(template: str, values: Mapping[str, Any], root: str) -> str:
    """A page from its template; ``root`` leads from it to the report's folder."""
    return _environment().get_template(template).render({**values, "root": root})


def _compiled() -> FileSystemBytecodeCache | None:
    """Compiled templates of earlier processes, which take longer than a small report; None without room for them."""
    folder = cache_root() / "templates"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return FileSystemBytecodeCache(str(folder))


@cache
def _environment() -> Environment:
    made = Environment(
        loader=PackageLoader("asset2sim.report"),
        bytecode_cache=_compiled(),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {
        "number": significant,
        "counted": count_in_words,
        "place": _place,
        "duration": duration,
        "page": page_path,
        "columns": _json,
        "moment": lambda time: f"{time:%Y-%m-%d %H:%M} UTC",
        "svg": Markup,
        "code": _code_words,
    }
    return made


def _json(value: object) -> Markup:
    """JSON that can stand in a script element."""
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=False)
    return Markup(text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e"))


def _code_words(text: str) -> Markup:
    """The text with what stands in backticks as code."""
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if index % 2 else part for index, part in enumerate(text.split("`"))
    )


def _place(path: str, parts: int = 2) -> Markup:
    """The end of a path, which says what it is; the whole path as its tooltip."""
    words = path.rstrip("/").split("/")
    shown = path if len(words) <= parts + 1 else "…/" + "/".join(words[-parts:])
    return Markup('<code title="{}">{}</code>').format(path, shown)
