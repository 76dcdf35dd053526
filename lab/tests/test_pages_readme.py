"""README's figures are those of the blocks and sections that its rows link to: a block that is made anew, or a number
that is changed by hand, turns these red."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pytest

from lab.pages.blocks import block_of
from lab.pages.stamp import split_stamp
from tests.assets import ROOT
from tests.test_project_links import mark

NUMBER = re.compile(r"(?<![\w.`/])\d+(?:\.\d+)?")
NAMES = {"VLM-IVW": "ivw", "direct VLM": "direct", "experts' scale and state": "reference", "ours": "asset2sim"}
"""README's name of a method → that of the robots' tables."""
COUNTS = {"four": 4, "nine": 9, "eleven": 11}


@dataclass(frozen=True)
class Row:
    """A row of one of README's tables of figures: its label, the page and heading that it links to, and its cells."""

    label: str
    page: str
    anchor: str
    model: str
    cells: tuple[str, ...]


def readme_rows(text: str) -> list[Row]:
    """The rows of the tables under "How good it is". A row without a link to a heading is an error."""
    section = text.split("## How good it is", 1)[1].split("\n## ", 1)[0]
    found = []
    for row in [row for table in tables(section) for row in table[1:]]:
        link = re.fullmatch(r"\[(.+)\]\((.+?)#(.+)\)", row[0])
        assert link, f"{row[0]} links to no heading of a page"
        found.append(Row(link[1], link[2], link[3], row[1].strip("`"), tuple(row[2:])))
    return found


def tables(text: str) -> list[list[list[str]]]:
    """Tables of a Markdown text, each as rows of cells, the headings first, without bold and small print."""
    found = []
    for part in re.findall(r"(?:^\|.*\n?)+", text, re.MULTILINE):
        rows = [[re.sub(r"<br>.*|\*\*", "", cell).strip() for cell in line.strip("|").split("|")]
                for line in part.splitlines()]  # fmt: skip
        found.append([row for row in rows if not set("".join(row)) <= set("-: ")])
    return found


def section_of(page: str, anchor: str) -> str:
    """The text under a heading of a page, up to the next one that is as high."""
    parts = re.split(r"^(#+) (.+)$", (ROOT / page).read_text(encoding="utf-8"), flags=re.MULTILINE)
    heads = list(zip(parts[1::3], parts[2::3], parts[3::3], strict=True))
    start = next(place for place, (_, head, _) in enumerate(heads) if mark(head) == anchor)
    depth = len(heads[start][0])
    end = next((n for n in range(start + 1, len(heads)) if len(heads[n][0]) <= depth), len(heads))
    return "\n".join(f"{sign} {head}{text}" for sign, head, text in heads[start:end])


def numbers(text: str) -> list[float]:
    return [float(found) for found in NUMBER.findall(text)]


def block(row: Row, name: str) -> tuple[list[list[list[str]]], str]:
    """The tables of the block under the row's heading, whose stamp names the row's model, and its text."""
    text, stamp = split_stamp(block_of(section_of(row.page, row.anchor), name) or "")
    if not text:
        pytest.xfail(f"block '{name}' is not made yet: make figures ONLY={name}")
    assert stamp is None or row.model in stamp.models, f"{row.label}: the block is of {stamp.models}"
    return tables(text), text


def ours_and_best(rates: dict[str, float]) -> tuple[float, str, float]:
    """Our figure, and the best other method with its own; ours without semantics is no other method."""
    others = {name: rate for name, rate in rates.items() if name not in ("asset2sim", "ours", "ours, no semantics")}
    best = max(others, key=lambda name: others[name])
    return rates.get("asset2sim", rates.get("ours", -1.0)), best, others[best]


def by_column(table: Sequence[Sequence[str]], label: str) -> dict[str, float]:
    """Heading → the first number of a row of that label, of all columns that have one but the paper's."""
    (row,) = (row for row in table if row[0] == label)
    pairs = zip(table[0][1:], row[1:], strict=True)
    return {head: numbers(cell)[0] for head, cell in pairs if numbers(cell) and head != "paper"}


def by_row(table: Sequence[Sequence[str]], heading: str) -> dict[str, float]:
    """Label → the first number in the column of that heading."""
    column = list(table[0]).index(heading)
    return {row[0]: numbers(row[column])[0] for row in table[1:] if numbers(row[column])}


def compared(row: Row) -> tuple[dict[str, float], int]:
    """Every method's figure in the block of a row of the second table, and over how many tasks or objects."""
    if row.anchor == "methods-compared":
        found, text = block(row, "compare")
        table = next(table for table in found if "drift passes %" in table[0])
        return by_row(table, "drift passes %"), int(numbers(text)[0])
    name = {"what-it-says": "judged", "what-was-learnt": "learn", "what-our-probes-did": "probe"}[row.anchor]
    (first, *others), _ = block(row, name)
    if name == "judged":
        return by_row(first, "tasks done"), len(others[0]) - 1
    if name == "learn":
        return by_column(first, "mean"), len(first) - 2
    return by_column(first, "scripted"), 0


def told(figure: float, text: str) -> bool:
    """Whether a text's first number is the figure, in the digits that the text gives."""
    found = NUMBER.findall(text)
    return bool(found) and float(found[0]) == round(figure, len(found[0].partition(".")[2]))


ROWS = readme_rows((ROOT / "README.md").read_text(encoding="utf-8"))
KNOWN = {"whole-datasets", "objects-from-other-hands"}


def test_readme_has_both_tables_and_every_row_names_its_model() -> None:
    assert [len(row.cells) for row in ROWS].count(1) >= 8 and [len(row.cells) for row in ROWS].count(2) == 4
    assert all(row.model in ("prior/household", "prior/noisy", "a vision-language model") for row in ROWS)


@pytest.mark.parametrize("row", [row for row in ROWS if row.anchor in KNOWN], ids=lambda row: row.label)
def test_whole_datasets_are_as_their_block_counts_them(row: Row) -> None:
    if row.anchor == "whole-datasets":
        (table, *_), _ = block(row, "dataset")
        (column,) = (place for place, head in enumerate(table[0]) if head and head in row.label)
        (ok,) = (line[column] for line in table if line[0].startswith("ok:"))
        good, count = numbers(ok)
    else:
        (table, *_), _ = block(row, "origins")
        good, count = (by_row(table, heading)["all"] for heading in ("ok", "objects"))
    assert [*numbers(row.label), *numbers(row.cells[0])] == [count, good]


@pytest.mark.parametrize("row", [row for row in ROWS if row.anchor == "held-out"], ids=lambda row: row.label)
def test_what_was_held_out_is_as_its_row_counts_it(row: Row) -> None:
    """The columns objects, ok, and right by a look."""
    lines = tables(section_of(row.page, row.anchor))[0][1:]
    sets = [(numbers(line[2]), [number for cell in line[3:5] for number in numbers(cell)[:1]]) for line in lines]
    assert (numbers(row.label), numbers(row.cells[0])) in sets


@pytest.mark.parametrize("row", [row for row in ROWS if len(row.cells) == 2], ids=lambda row: row.label)
def test_what_is_compared_is_as_its_block_has_it_and_no_other_method_is_better(row: Row) -> None:
    rates, count = compared(row)
    ours, best, rate = ours_and_best(rates)
    assert told(ours, row.cells[0]), f"{row.label}: the block has {ours:g} for ours"
    named = row.cells[1].rpartition(", ")[0]
    assert best in (named, NAMES.get(named)), f"{row.label}: the best other method is {best}"
    assert told(rate, row.cells[1].rpartition(", ")[2]), f"{row.label}: the block has {rate:g} for {best}"
    said = [COUNTS[word] for word in re.findall(r"\w+", row.label) if word in COUNTS] or numbers(row.label)
    assert not (said and count) or said == [count], f"{row.label}: the block is of {count}"


@pytest.mark.parametrize("row", [r for r in ROWS if r.anchor == "measured-by-others"], ids=lambda row: row.label)
def test_what_others_measured_is_as_the_section_tells_it(row: Row) -> None:
    text = " ".join(section_of(row.page, row.anchor).split())
    (count,), figures = numbers(row.label), numbers(row.cells[0])
    assert stands_in(count, figures, numbers(text)), f"{row.label}: {figures} is not told in {numbers(text)}"
    assert row.model in text


def stands_in(count: float, figures: Sequence[float], there: Sequence[float]) -> bool:
    """Whether figures stand one after the other in a text's numbers: one alone right after the count of objects,
    several with nothing but that count between them."""
    if len(figures) == 1:
        return any(pair == (count, figures[0]) for pair in pairwise(there))
    others = [number for number in there if number != count]
    return count in there and any(others[place : place + len(figures)] == list(figures) for place in range(len(others)))


def test_a_figure_that_differs_and_a_row_without_its_heading_are_found(tmp_path: Path) -> None:
    table = [["method", "done"], ["ours", "10 of 11"], ["ivw", "7 of 11"], ["ours, no semantics", "9 of 11"]]
    assert ours_and_best(by_row(table, "done")) == (10.0, "ivw", 7.0)
    assert told(66.2, "66 %") and told(66.2, "66.2 %") and not told(66.2, "67 %") and not told(66.2, "none")
    across = [["task", "reference", "paper", "asset2sim"], ["mean", "66.2 %", "99.0 %", "100.0 %"]]
    assert by_column(across, "mean") == {"reference": 66.2, "asset2sim": 100.0}
    assert stands_in(45, [44, 43, 56, 58], [45, 44, 43, 45, 56, 58]) and not stands_in(45, [44, 56], [45, 44, 43, 56])
    assert stands_in(51, [50], [95, 51, 50]) and not stands_in(51, [95], [95, 51, 50])
    with pytest.raises(AssertionError, match="links to no heading"):
        readme_rows("## How good it is\n\n| a | model | ok |\n| --- | --- | --- |\n| [5](docs/x.md) | `y` | 5 |\n")
