"""Our masses of objects and parts beside published weights: ``make weights`` writes the table into the documentation.

``python -m lab.weights.compare SHARED PAGE`` weighs every object of the datasets below SHARED as
``prior/household`` proposes and validation completes it; no engine runs.
"""

import csv
import math
import re
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, median

from asset2sim.assets.extract import Extraction
from asset2sim.catalog.text import NOTHING, markdown_table
from asset2sim.guidance import tables
from asset2sim.guidance.parts import part_name, parts_of
from asset2sim.guidance.read import read_guidance
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.origin import extract
from asset2sim.models.object_facts import rounded_object_info
from asset2sim.models.prior.answer import prior_overlay
from asset2sim.validation.validate import validate
from lab.pages.blocks import write_block
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source

DATASETS = ("partnet_mobility", "other_furniture")
FACTOR = 1.5
"""Factor between our mass and the middle of the published ones up to which they agree."""
FITTING_SHARE = 0.25
"""Share of the largest face among links of one name below which a link is a fitting: a handle called as its door."""
TYPICAL = "typical"
"""Word of a source that cites no single figure."""
WHOLE = "*"
"""The part that stands for the whole object."""


@dataclass(frozen=True)
class PublishedWeight:
    """Published weights of an object or part: from ``low`` to ``high``, in kg, or kg/m² of the part's largest face.
    Nothing was fitted on a row that is ``held_out``."""

    what: str
    category: str
    part: str
    unit: str
    low: float
    high: float
    held_out: bool
    source: str

    @property
    def middle(self) -> float:
        """Geometric mean of the published weights."""
        return math.sqrt(self.low * self.high)

    @property
    def typical(self) -> bool:
        """Whether it rests on what is typical, and on no published figure of one product."""
        return TYPICAL in self.source.lower()


@dataclass(frozen=True)
class Weighed:
    """One object as we refine it, at its usual size: its category, its mass (kg), and part → (mass in kg, largest face
    in m²) of each link of that name; "" is the body."""

    asset_id: str
    category: str
    mass_kg: float
    parts: dict[str, list[tuple[float, float]]]
    face_m2: float
    """The largest face of any link."""
    fitted: bool
    """Whether its own prompt has the parts' masses scaled together to reach a usual total."""


@dataclass(frozen=True)
class Compared:
    """A reference with our median over ``count`` objects, in the reference's unit; None without any object."""

    reference: PublishedWeight
    ours: float | None
    count: int

    @property
    def factor(self) -> float | None:
        """Ours over the middle of the published."""
        return None if self.ours is None else self.ours / self.reference.middle

    @property
    def agrees(self) -> bool:
        """Whether ours is within ``FACTOR`` of the middle of the published."""
        return self.factor is not None and 1.0 / FACTOR <= self.factor <= FACTOR


def references() -> tuple[PublishedWeight, ...]:
    """The published weights, each with its source."""
    with (Path(__file__).parent / "reference_weights.csv").open(encoding="utf-8", newline="") as file:
        return tuple(
            PublishedWeight(
                row["what"], row["category"], WHOLE if row["kind"] == "object" else row["part"], row["unit"],
                float(row["low"]), float(row["high"]), row["held_out"] == "yes", row["source"],
            )
            for row in csv.DictReader(file)
        )  # fmt: skip


def usual_size(prompt: str) -> str:
    """The prompt without its words about the object's size: published weights are those of the usual one."""
    words = sorted((" ".join(phrase) for phrase in tables.size_words()), key=len, reverse=True)
    plain = re.sub(rf"\b({'|'.join(map(re.escape, words))})\b", " ", prompt, flags=re.IGNORECASE)
    return re.sub(r"\s+", " ", plain).strip()


def weigh(extraction: Extraction, prompt: str) -> Weighed:
    """One object as the prior proposes it for a prompt without words of size, and validation completes it."""
    settings = PhysicsSettings()
    info = rounded_object_info(extraction.features)
    fitted = prior_overlay(info, prompt).mass_change is not None
    prompt = usual_size(prompt)
    category = read_guidance(prompt, info).category
    proposal = prior_overlay(info, prompt)
    overlay, _ = validate(extraction, proposal, Source.PRIOR, settings.contact_friction, settings)
    moving = {part.link.name: part.name for part in parts_of(info, category) if part.link is not None}
    parts: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for link in overlay.links:
        seen = extraction.features.link(link.name)
        if seen.has_geometry:
            edges = sorted(edge * overlay.scale for edge in seen.box_size)
            name = moving.get(link.name) or part_name(seen.label)
            parts[name].append((link.mass_kg, edges[1] * edges[2]))
    face = max(face for links in parts.values() for _, face in links)
    return Weighed(extraction.features.asset_id, category, overlay.mass_kg, dict(parts), face, fitted)


def weigh_datasets(shared: Path, categories: Iterable[str] = ()) -> Iterator[Weighed]:
    """Every object of the datasets in a folder at its usual size; ``categories`` chooses by the manifest's category."""
    wanted = set(categories)
    for name in DATASETS:
        for ref in load_dataset(shared / name):
            if not wanted or ref.category in wanted:
                yield weigh(extract(ref), ref.prompt or "")


def compare(weighed: Sequence[Weighed], rows: Sequence[PublishedWeight]) -> list[Compared]:
    """Each reference with the median over the objects of its category: of a part, over each object's own median."""
    found = []
    for row in rows:
        objects = [item for item in weighed if item.category == row.category]
        if row.part == WHOLE:
            ours = [item.mass_kg / (item.face_m2 if row.unit == "kg/m2" else 1.0) for item in objects]
        else:
            ours = [_of_part(item.parts[row.part], row) for item in objects if row.part in item.parts]
        found.append(Compared(row, median(ours) if ours else None, len(ours)))
    return found


def _of_part(links: Sequence[tuple[float, float]], row: PublishedWeight) -> float:
    if row.part == "":
        links = [max(links)]
    if row.unit == "kg":
        return median(mass for mass, _ in links)
    largest = max(face for _, face in links)
    return median(mass / face for mass, face in links if face >= FITTING_SHARE * largest)


def agreement(rows: Sequence[Compared]) -> tuple[int, int]:
    """How many rows agree, and of how many there are objects."""
    measured = [row for row in rows if row.ours is not None]
    return sum(row.agrees for row in measured), len(measured)


def errors(rows: Sequence[Compared]) -> tuple[float, float, float]:
    """The errors that NeRF2Physics and PhysGS publish of masses m̂ beside m, over the rows with objects: ALDE, the mean
    of |ln m̂ − ln m|; APE, of |m̂ − m| / m; MnRE, of the smaller of m̂ / m and m / m̂, 1 being perfect. NaN for none."""
    factors = [row.factor for row in rows if row.factor is not None]
    if not factors:
        return math.nan, math.nan, math.nan
    return (
        fmean(abs(math.log(factor)) for factor in factors),
        fmean(abs(factor - 1.0) for factor in factors),
        fmean(min(factor, 1.0 / factor) for factor in factors),
    )


def weights_block(weighed: Sequence[Weighed]) -> str:
    """The page's block: the shares that agree, and every row with its source."""
    rows = compare(weighed, references())
    held_out = [row for row in rows if row.reference.held_out]
    published = [row for row in rows if not row.reference.typical]
    shares, measured = [], []
    for words, chosen in (
        ("", rows),
        (" of those held out", held_out),
        (" of those with a published figure", published),
        (" of those held out with one", [row for row in held_out if row in published]),
    ):
        good, total = agreement(chosen)
        figures = (f"{error:.2f}" for error in errors(chosen))
        measured.append((words.removeprefix(" of ") or "all", str(total), *figures))
        shares.append(f"{good} of {total}{words} ({good / max(total, 1):.0%})")
    fitted = sum(item.fitted for item in weighed)
    text = (
        f"Medians over {len(weighed)} objects of `../shared` at their usual size. Within a factor of {FACTOR:g} of the "
        f"middle of the published range: {', '.join(shares)}. Totals that had to be brought into their category's "
        f"range (finding `mass_fitted`), with their own prompts: {fitted} of {len(weighed)}. Rows marked * are held "
        "out: no thickness was chosen by them. Rows marked † rest on what is typical, and on no published figure.\n\n"
        + markdown_table(("rows", "n", "ALDE", "APE", "MnRE"), measured, right=(1, 2, 3, 4))
    )
    headings = ("what", "published", "ours", "factor", "objects", "source of the published weight")
    table = markdown_table(headings, [_cells(row) for row in rows], right=(1, 2, 3, 4))
    return f"{text}\n\n{table}"


def marks(reference: PublishedWeight) -> str:
    """Mark behind a row's name: * for one that is held out, † for one without a published figure."""
    return (" *" if reference.held_out else "") + (" †" if reference.typical else "")


def _cells(row: Compared) -> tuple[str, ...]:
    reference = row.reference
    unit = " kg/m²" if reference.unit == "kg/m2" else " kg"
    return (
        f"{reference.what}{marks(reference)}",
        f"{reference.low:g} to {reference.high:g}{unit}",
        NOTHING if row.ours is None else f"{row.ours:.2g}{unit}",
        NOTHING if row.factor is None else f"{row.factor:.2f}{'' if row.agrees else ' !'}",
        str(row.count),
        reference.source,
    )


if __name__ == "__main__":
    shared_folder, page = sys.argv[1:]
    write_block(Path(page), "weights", weights_block(list(weigh_datasets(Path(shared_folder)))))
