"""Numbers and tables for people, in Markdown and on the terminal, and the console that commands write to."""

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence

from rich import box
from rich.console import Console, ConsoleOptions, ConsoleRenderable, RenderHook, RenderResult
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from schemas.errors import printable
from schemas.extensions import checks, object_at

NOTHING = "–"
"""Placeholder for a missing value."""
WIDE = 120
"""Columns where there is no terminal to ask: the tables must not be folded in a log."""
_BAR = re.compile(r"(?<!\\)\|")
_BLANK = re.compile(r"[ \t\r\n]+")


MAX_CELL = 500
"""Characters of a text that a table for the terminal shows: a prompt may have a million."""


def output() -> Console:
    """Standard output: as wide as the terminal, or ``WIDE`` columns in a file or a pipe. What it prints is shown, never
    obeyed: escapes in a prompt or a name are left out, brackets are brackets."""
    console = Console(highlight=False, markup=False)
    if not console.is_terminal or not console.file.isatty():
        console.width = WIDE
    console.push_render_hook(_OnlyPrintable())
    return console


def cut_text(text: str, most: int = MAX_CELL) -> str:
    """The text, at most so many characters of it, and then how many there are."""
    return text if len(text) <= most else f"{text[:most]}… ({len(text)} characters)"


class _OnlyPrintable(RenderHook):
    """Takes control characters out of whatever is rendered; styles are added after that."""

    def process_renderables(self, renderables: list[ConsoleRenderable]) -> list[ConsoleRenderable]:
        """The renderables, each without control characters."""
        return [_Printable(renderable) for renderable in renderables]


class _Printable:
    """A renderable without its control characters; they take no width, so tables stay as they are."""

    def __init__(self, renderable: ConsoleRenderable) -> None:
        self._renderable = renderable

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        for segment in console.render(self._renderable, options):
            yield segment if segment.control else Segment(printable(segment.text), segment.style)


def significant(value: object, unit: str = "", digits: int = 3) -> str:
    """A number to so many significant digits, without a needless exponent; ``NOTHING`` for None and NaN."""
    if not isinstance(value, int | float) or math.isnan(value):
        return NOTHING
    if isinstance(value, int) or (float(value).is_integer() and abs(value) < 10**digits):
        shown = f"{int(value)}"
    elif 1e-4 <= abs(value) < 1e6:
        decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        shown = f"{value:.{min(decimals, 6)}f}"
    else:
        shown = f"{value:.{digits - 1}e}"
    return f"{shown} {unit}" if unit else shown


def numbers_in_brackets(values: Iterable[object]) -> str:
    """Numbers in brackets."""
    return f"({', '.join(map(significant, values))})"


def further_lines(asset: Mapping[str, object]) -> list[tuple[str, str, str]]:
    """Measurements of further checks (``--check``) in an asset's row: (check, its columns in words, its description);
    none for a check that was not asked for, or had nothing to try."""
    found = []
    for check in checks().values():
        words = []
        for column, _, unit, _ in object_at(check.columns):
            value, unit = asset.get(column), "" if unit == "1" else unit
            shown = value if isinstance(value, str) else significant(value, unit)
            name = column.removeprefix(check.name).removesuffix(f"_{unit}").strip("_").replace("_", " ")
            words += [f"{name} {shown}".strip()] if shown != NOTHING else []
        found += [(check.name, ", ".join(words), check.description)] if words else []
    return found


def duration(seconds: float) -> str:
    """Seconds as people say them: "48 s", "12 min", "3 h 05 min"."""
    minutes = round(seconds / 60.0)
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[str]], right: Collection[int] = ()) -> str:
    """Markdown table; ``right`` holds the indices of right-aligned columns. A cell becomes one line, and each ``|`` in
    it that has no backslash yet gets one."""
    rule = ["---:" if index in right else "---" for index in range(len(headings))]
    cells = [[_BAR.sub(r"\\|", _BLANK.sub(" ", cell).strip()) for cell in row] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in (headings, rule, *cells))


def plus_or_minus(sigma: object) -> str:
    """A relative standard deviation, as " ± 12 %"; "" for none."""
    return f" ± {100.0 * sigma:.0f} %" if isinstance(sigma, float) and sigma > 0.0 else ""


def percent(count: int, total: int) -> str:
    """A share, as "98.7 %"; "100 %" only where it is all of them, "0 %" only where it is none."""
    if count in (0, total):
        return "100 %" if count else "0 %"
    return f"{min(99.9, max(0.1, 100.0 * count / total)):.1f} %"


def titled_table(title: str) -> Table:
    """An empty table for the terminal, with a bold title on the left."""
    return Table(box=box.SIMPLE_HEAD, title=title, title_justify="left", title_style="bold")


def number_table(title: str, headings: Iterable[str], rows: Iterable[Iterable[object]], left: int) -> Table:
    """Table for the terminal whose first ``left`` columns are text and whose others are numbers. Cells of rich's
    ``Text`` keep their style; all others are shown literally."""
    table = titled_table(f"\n{title}")
    table.padding = (0, 1, 0, 0)
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="left" if index < left else "right", overflow="fold")
    for row in rows:
        table.add_row(*(cell if isinstance(cell, Text) else Text(cut_text(str(cell))) for cell in row))
    return table
