"""A comma-separated table that a user wrote: its rows, or what is wrong with it and in which line."""

import codecs
import csv
import io
import logging
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from asset2sim.storage.regular_files import printable
from schemas.errors import Mistakes, UsageError, first_words, shortened

MAX_TABLE_BYTES = 256 * 1024 * 1024
"""Largest table that is read: a million assets with a long prompt each."""
MAX_CELL_LENGTH = 10_000
"""Characters of a cell: a prompt is a sentence or a page, and a cell beyond has swallowed others."""
NEAR = 0.7
"""Likeness (``difflib``) from which an unknown column is a known one misspelt."""
UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
AS_UTF_8 = "save it as UTF-8 (in spreadsheets: CSV UTF-8, separated by commas)"
SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars"}

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Columns:
    """The columns that a table must have, those that it may have, beginnings of the names of more, and those whose
    cells may hold line breaks."""

    required: Sequence[str]
    known: Sequence[str]
    prefixes: tuple[str, ...] = ()
    prose: Sequence[str] = ()


def read_rows(content: bytes, name: str, columns: Columns, mistakes: Mistakes) -> list[tuple[int, dict[str, str]]]:
    """The line and the stripped cells by column of every row below the heading that is right; blank rows are left out.

    ``mistakes`` get what names the table and the line: a column that is missing, there twice or misspelt, a quote that
    is not closed or swallows rows, a cell that is too long, more cells than columns. Raises UsageError for what is no
    text in UTF-8. A column that is unknown and like none is a warning.
    """
    rows = _cells(_text(content, name), name)
    found: list[tuple[int, dict[str, str]]] = []
    with mistakes:
        _, first = next(rows, (1, []))
        heading = [cell.strip() for cell in first]
        with mistakes:
            _check_heading(heading, name, columns)
        if not {*columns.required} <= {*heading}:
            return []
        for line, cells in rows:
            where, before = f"{name}, line {line}", len(mistakes.said)
            row = dict(zip(heading, (cell.strip() for cell in cells), strict=False))
            with mistakes:
                if len(cells) > len(heading):
                    raise UsageError(f"{where}: more cells than columns; put quotes round a text that holds a comma")
            for column, cell in row.items():
                with mistakes:
                    _check_cell(cell, column, where, len(heading), columns)
            if len(mistakes.said) == before:
                found.append((line, row))
    return found


def _text(content: bytes, name: str) -> str:
    if len(content) > MAX_TABLE_BYTES:
        raise UsageError(f"{name}: over {MAX_TABLE_BYTES // 1024**2} MB; split the dataset")
    if content.startswith(UTF_16):
        raise UsageError(f"{name}: its text is in UTF-16, not in UTF-8; {AS_UTF_8}")
    if (place := content.find(b"\0")) >= 0:
        raise UsageError(
            f"{name}, line {_line(content, place)}: it holds a NUL byte, as no text in UTF-8 does; {AS_UTF_8}"
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = error.start + (len(codecs.BOM_UTF8) if content.startswith(codecs.BOM_UTF8) else 0)
        problem = f"byte 0x{content[place]:02x} is not UTF-8"
        raise UsageError(f"{name}, line {_line(content, place)}: {problem}; {AS_UTF_8}") from error


def _line(content: bytes, place: int) -> int:
    return content.count(b"\n", 0, place) + 1


def _cells(text: str, name: str) -> Iterator[tuple[int, list[str]]]:
    """The line at which a row begins, and its cells; raises UsageError where quotes do not match."""
    reader = csv.reader(io.StringIO(text, newline=""), skipinitialspace=True, strict=True)
    while True:
        line = reader.line_num + 1
        try:
            cells = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise UsageError(f"{name}, line {line}: {_quote_problem(error, line, reader.line_num)}") from error
        if cells:
            yield line, cells


def _quote_problem(error: csv.Error, first: int, last: int) -> str:
    if "field limit" in str(error):
        return f"a cell has over {csv.field_size_limit():,} characters; a quote that is not closed makes such"
    if "unexpected end" in str(error):
        return f'a quote opens here, and nothing closes it down to line {last}; close it, or write it twice ("")'
    what = f"down to line {last}" if last > first else "here"
    return f'a quote ends in the middle of a cell {what} ({error}); write a quote within quotes twice ("")'


def _check_heading(heading: Sequence[str], name: str, columns: Columns) -> None:
    named = [column for column in heading if column]
    if len(named) == 1 and (wrong := next((word for mark, word in SEPARATORS.items() if mark in named[0]), None)):
        raise UsageError(f"{name}: its heading is '{_shown(named[0])}'; separate cells by commas, not by {wrong}")
    may_be = f"it has {', '.join(map(_shown, named[:20])) or 'none'}, and columns may be "
    may_be += ", ".join([*columns.known, *(f"{prefix}…" for prefix in columns.prefixes)])
    wrong_ones = [f"column '{each}' names nothing after its colon" for each in named if each in columns.prefixes]
    unknown = [each for each in named if each not in columns.known and not each.startswith(columns.prefixes)]
    meant = set[str]()
    for column in unknown:
        likely = [known for known in columns.known if known.lower() == column.lower()]
        likely = likely or get_close_matches(column.lower(), columns.known, 1, NEAR)
        if likely and likely[0] not in named:
            wrong_ones.append(f"column '{_shown(column)}' is unknown; is it '{likely[0]}'?")
            meant.add(likely[0])
    if missing := [column for column in columns.required if column not in (*named, *meant)]:
        wrong_ones.append(f"column {', '.join(missing)} missing")
    if twice := [column for column, count in Counter(named).items() if count > 1]:
        wrong_ones.append(f"column {', '.join(map(_shown, twice[:5]))} more than once; keep one of each")
    if wrong_ones:
        raise UsageError(*(f"{name}: {each}" for each in wrong_ones[:-1]), f"{name}: {wrong_ones[-1]}; {may_be}")
    if unknown:
        said = first_words([*map(_shown, unknown)], 10)
        logger.warning("%s: nothing reads column %s; columns may be %s", name, said, may_be.split("may be ")[1])


def _shown(cell: str) -> str:
    """A cell for a message, on one line."""
    return shortened(printable(cell), 40)


def _check_cell(cell: str, column: str, where: str, width: int, columns: Columns) -> None:
    if len(cell) > MAX_CELL_LENGTH:
        what = f"column '{_shown(column)}' has {len(cell):,} characters ('{_shown(cell)}')"
        raise UsageError(f"{where}: {what}, over {MAX_CELL_LENGTH:,}; shorten it")
    after = cell.splitlines()[1:]
    if not after:
        return
    if any(_like_a_row(line, width) for line in after) or column not in columns.prose:
        raise UsageError(
            f"{where}: its cell '{_shown(column)}' goes on over {len(after)} more lines: a quote that should not be "
            'there, or is not closed; write a quote that is meant twice (""), and a text on one line'
        )


def _like_a_row(line: str, width: int) -> bool:
    """Whether a line within a cell may be a row that a quote has swallowed; prose has a space after its commas."""
    return line.count(",") + 1 >= width or ("," in line and ", " not in line)
