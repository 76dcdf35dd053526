"""The data files beside this module as frozen rows. Every row states its source; nothing here is per object."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field

from asset2sim.guidance.csv_rows import csv_rows, typed_rows
from schemas.mechanism import MechanismName

Names = Annotated[tuple[str, ...], BeforeValidator(lambda cell: cell.split("|"))]
"""Names with bars between them."""


@dataclass(frozen=True)
class Size:
    """A category's typical size. ``dimension``: longest edge, height or width (seen from its front, which is
    along x) of the closed object, or its body's longest edge.
    ``across_max_m`` is the most that the second longest edge may be, 0 for any: a jar is no bottle lying down.
    ``refines``: categories of which this is a kind, so that a word for it in the guidance says more than they do.
    ``lies``: such a thing is put down on whatever side it comes to rest."""

    category: str
    dimension: str
    typical_m: float
    min_m: float
    max_m: float
    mass_min_kg: float
    mass_max_kg: float
    contact: str
    lies: bool
    across_max_m: float = 0.0
    refines: Names = ()


@dataclass(frozen=True)
class Proportions:
    """Usual depth, width and height of one ``kind`` of a category, m, each with its spread (σ of its logarithm), how
    that kind is ``placed`` where that is not as its category is (a cupboard of a "wall", what "stands" or "hangs"), the
    ``category`` that it is of its own, "" for none, and all that it ``has``, or with a minus before does not have: a
    part, several "doors", a "level hinge", a "plinth"; ``odds``: how often it is met, for once of most others."""

    kind: str
    usual_m: tuple[float, float, float]
    spread: tuple[float, float, float]
    placed: str
    category: str = ""
    has: str = ""
    odds: float = 1.0

    def may_have(self, parts: frozenset[str]) -> bool:
        """Whether an object with these ``parts`` may be of this kind."""
        return all((part[0] != "-") is (part.removeprefix("-") in parts) for part in self.has.split("|") if part)


@dataclass(frozen=True)
class Material:
    """Density, the thickness of its walls relative to moulded plastic, and the Coulomb coefficient on a table."""

    name: Annotated[str, Field(alias="material")]
    density_kg_m3: float
    wall_factor: float
    friction: float


@dataclass(frozen=True)
class PartMaterial:
    """Material of a part: a wall, or the share of its hull's volume that is material. ``wall_m`` (0 for a solid) is
    the wall's thickness over the part's outer area: as built, times the share of that area that has such a wall."""

    material: str
    hollow: float
    wall_m: float


@dataclass(frozen=True)
class PartContent:
    """Something heavy inside a part of an object of typical size: its mass, kg, its height in the part's box and its
    depth from the front, as shares. An object that has one of the parts in ``unless`` has it there, not inside; one
    without the part ``only`` has none."""

    name: Annotated[str, Field(alias="content")]
    mass_kg: float
    height: float
    depth: float
    unless: Names = ()
    only: str = ""


@dataclass(frozen=True)
class PartMechanism:
    """How a part moves. ``role``: main (opens), cap, control, roll, minor. ``kind``: what people call it.
    ``usual_rad``: how far a hinged part is opened in use, from closed: no lid is by 270°. ``click_rad``: the turn from
    one detent to the next; 0 without."""

    role: str
    coast_s: float
    kind: Annotated[MechanismName, Field(alias="mechanism")]
    spring_hz: float | None = None
    spring_rest: str = ""
    usual_rad: Annotated[float, Field(alias="usual_deg"), AfterValidator(math.radians)] = math.inf
    press_start_n: float | None = None
    press_end_n: float | None = None
    click_rad: Annotated[float, Field(alias="click_deg"), AfterValidator(math.radians)] = 0.0

    @property
    def press_n(self) -> tuple[float, float] | None:
        """Resistance of its spring at the start and end of its travel, N, at a hinge's far edge; None for most."""
        start, end = self.press_start_n, self.press_end_n
        return None if start is None or end is None else (start, end)

    @property
    def lets_go_n(self) -> float | None:
        """Resistance of a catch or gasket at first, N, at the same edge; None without."""
        return self.press_start_n if self.press_end_n is None else None


@dataclass(frozen=True)
class PartEffort:
    """The forces (N at its edge) between which a part of a ``kind`` moves, for parts ``up_to_m`` long; the least also
    as a share of the part's weight, which its pins and rollers rub. ``anywhere``: people leave it at any position, not
    only at an end or where it is asked to be. ``counterbalanced``: springs carry its weight. ``braced``: the other hand
    holds the object meanwhile."""

    kind: str
    least_n: float
    least_share: float
    most_n: float
    anywhere: Annotated[bool, Field(alias="left"), BeforeValidator(lambda cell: cell == "anywhere")]
    counterbalanced: bool
    braced: bool
    source: str
    up_to_m: float = math.inf


@dataclass(frozen=True)
class PartSize:
    """The usual length, m, of an ``edge`` of a part, its height or its larger one across, and its relative spread."""

    part: str
    edge: str
    usual_m: float
    spread: float
    source: str


@dataclass(frozen=True)
class MotionWord:
    """Meaning of a word about motion: seconds to fall shut from half open, metres (slider) or radians (hinge)
    that it glides when let go, seconds in which a spring brings it back."""

    closes_s: float | None = None
    stops_m: float | None = None
    stops_rad: float | None = None
    returns_s: float | None = None


@dataclass(frozen=True)
class Word:
    """Meaning of a phrase of the guidance."""

    kind: str
    value: str


Phrase = tuple[str, ...]

UNKNOWN = "*"
"""The category of an object of which nothing says what it is."""
SMALL_M = 0.4
"""Longest edge, m, up to which such an object is taken for one of plastic: of known kinds most are."""
CASING = ("", "door", "lid", "spout")
"""Parts that are as the object's casing is, where no row says how such an object is built."""


@lru_cache
def sizes() -> dict[str, Size]:
    """Category → size; "*" is the fallback."""
    return {size.category: size for _, size in typed_rows("sizes", Size)}


@lru_cache
def materials() -> dict[str, Material]:
    """Name → material."""
    return {material.name: material for _, material in typed_rows("materials", Material)}


@lru_cache
def nouns() -> dict[Phrase, str]:
    """Noun phrase → category."""
    return {tuple(row["phrase"].split()): row["category"] for row in csv_rows("synonyms")}


@lru_cache
def size_words() -> dict[Phrase, float]:
    """Phrase → factor on the typical size."""
    return {tuple(row["phrase"].split()): float(row["factor"]) for row in csv_rows("size_words")}


@lru_cache
def tabletop_words() -> frozenset[str]:
    """Words of size that ask for a thing that is handled on a table, as the paper's prompts use "small"."""
    return frozenset(row["phrase"] for row in csv_rows("size_words") if row["tabletop"] == "yes")


@lru_cache
def words() -> dict[Phrase, Word]:
    """Phrase → meaning."""
    return {tuple(row["phrase"].split()): Word(row["kind"], row["value"]) for row in csv_rows("words")}


@lru_cache
def material_words() -> dict[str, str]:
    """A word of the guidance → material."""
    return {row["word"]: row["material"] for row in csv_rows("material_words")}


@lru_cache
def proportions() -> dict[str, tuple[Proportions, ...]]:
    """Category → the three edges of each of its kinds, of categories whose longest edge says little."""
    found: dict[str, tuple[Proportions, ...]] = {}
    for row in csv_rows("proportions"):
        usual = (float(row["depth_m"]), float(row["width_m"]), float(row["height_m"]))
        spread = (float(row["depth_spread"]), float(row["width_spread"]), float(row["height_spread"]))
        kind = Proportions(row["kind"], usual, spread, row["placed"], row["as"], row["has"], float(row["odds"] or 1.0))
        for category in filter(None, (row["category"], row["as"])):
            found[category] = (*found.get(category, ()), kind)
    return found


@lru_cache
def part_sizes(category: str) -> tuple[PartSize, ...]:
    """The parts that have about the same size on all things of a category, or of the one of which it is a kind."""
    return tuple(size for row, size in typed_rows("part_sizes", PartSize) if row["category"] in built_as(category))


@lru_cache
def built_as(category: str) -> tuple[str, ...]:
    """The category and the one of which it is a kind: what says nothing of a chest freezer is as of a refrigerator.
    Kinds are told by their edges, or by words."""
    known = {row["as"]: row["category"] for row in csv_rows("proportions") if row["as"]}
    kinds = {size.category: size.refines[0] for size in sizes().values() if size.refines and _as_its_kind(size)}
    return (category, whole) if (whole := (kinds | known).get(category)) else (category,)


@lru_cache
def works_as(category: str) -> tuple[str, ...]:
    """The category and the one of which it is a kind, of whatever it is made: a steel flask's lid is a bottle's. Not of
    kinds that have rows of how they are built."""
    built, kind = built_as(category), sizes().get(category)
    if len(built) > 1 or kind is None or not kind.refines or (category, "*") in _part_materials():
        return built
    return (category, kind.refines[0])


def _as_its_kind(kind: Size) -> bool:
    """Whether no row says how a kind is built, and it stands on what the category does of which it is one first."""
    whole = sizes().get(kind.refines[0])
    return whole is not None and whole.contact == kind.contact and (kind.category, "*") not in _part_materials()


@lru_cache
def part_words() -> dict[str, tuple[str, ...]]:
    """A part's name in plain words → parts, the best match first; "@hinge", "@slider", "@main" stand for joints."""
    return {row["word"]: tuple(row["parts"].split("|")) for row in csv_rows("part_words")}


@lru_cache
def part_labels() -> dict[str, str]:
    """A link's label, or a word for a part, → part."""
    words = {word: parts[0] for word, parts in part_words().items() if not parts[0].startswith("@")}
    return words | {row["label"]: row["part"] for row in csv_rows("part_labels")}


@lru_cache
def coast_times() -> dict[str, float]:
    """A level of damping → the time in which a free joint loses 63 % of its speed, s."""
    return {row["level"]: float(row["coast_s"]) for row in csv_rows("damping_levels")}


@lru_cache
def wishes() -> dict[str, MotionWord]:
    """A word about motion → the time or distance that it stands for."""
    return {row["word"]: word for row, word in typed_rows("wishes", MotionWord)}


@lru_cache
def part_material(category: str, part: str) -> PartMaterial:
    """The most specific row: category and part, then category for its body, then part, then anything. A part that has a
    row of its own (a button, a wheel) is the same on every object, so it goes before the body."""
    table = _part_materials()
    names = built_as(category)
    casings = [name for name in names if name not in sizes() or sizes()[name].contact == sizes()[category].contact]
    keys = (*((name, part) for name in names), ("*", part), *((name, "*") for name in casings), ("*", "*"))
    row = next(table[key] for key in keys if key in table)
    if has_part(category, part) or part not in CASING or is_built(category):
        return row
    # No row says how such an object is built: its casing is of what it stands on, unless that is its feet.
    skin = materials()[sizes()[category].contact]
    if skin.name == "rubber":
        return row
    return PartMaterial(skin.name, row.hollow, row.wall_m * skin.wall_factor)


def unknown_casing(longest_m: float) -> PartMaterial:
    """How the casing of an object of this longest edge is built of which nothing says what it is."""
    return _part_materials()["?", "small" if longest_m <= SMALL_M else "large"]


@lru_cache
def has_part(category: str, part: str) -> bool:
    """Whether a row says how that part of objects of this category is built."""
    return any((name, part) in _part_materials() for name in built_as(category))


@lru_cache
def is_built(category: str) -> bool:
    """Whether rows say how objects of a category are built, as none does of one that is not known."""
    return category not in sizes() or (category, "*") in _part_materials()


@lru_cache
def part_contents(category: str, part: str) -> tuple[PartContent, ...]:
    """Contents of that part of an object of that category, "" being its body."""
    rows = list(typed_rows("contents", PartContent))
    name = next((name for name in built_as(category) if any(row["category"] == name for row, _ in rows)), category)
    return tuple(found for row, found in rows if row["category"] == name and row["part"] == (part or "*"))


@lru_cache
def mechanism(part: str, category: str, motion: str) -> PartMechanism:
    """The most specific row for the part, the category and the motion (hinge, slider, spin): what all that moves on a
    category's objects does (a tap's handle, whatever it is called) goes before what such a part does elsewhere."""
    table = _mechanisms()
    named = (key for name in works_as(category) for key in ((part, name, motion), ("*", name, motion)))
    keys = (*named, (part, "*", motion), ("*", "*", motion))
    return next(table[key] for key in keys if key in table)


@lru_cache
def part_effort(part: str, category: str, motion: str, length_m: float = 0.0, *, loose: bool = False) -> PartEffort:
    """The most specific row for the part, the category and the motion (hinge, slider, or spin for what is round about
    its axis) that is made for its length, in the order of ``mechanism``. A part of no row of its own that moves freely
    (``loose``) has theirs."""
    table = _part_efforts()
    named = [key for name in works_as(category) for key in ((part, name), ("*", name))]
    names = [*named, (part, "*"), *([("loose", "*")] if loose else []), ("*", "*")]
    keys = [(p, c, m) for p, c in names for m in (motion, "*")]
    return next(row for key in keys for row in table.get(key, ()) if length_m <= row.up_to_m)


def turns_as_its_kind(part: str, category: str) -> bool:
    """Whether the part has forces of its own for turning about itself, whatever its shape: a pump's head."""
    return any((part, name, "spin") in _part_efforts() for name in works_as(category))


@lru_cache
def _part_efforts() -> dict[tuple[str, str, str], tuple[PartEffort, ...]]:
    table: dict[tuple[str, str, str], tuple[PartEffort, ...]] = {}
    for row, effort in typed_rows("efforts", PartEffort):
        key = (row["part"], row["category"], row["motion"])
        table[key] = (*table.get(key, ()), effort)
    return table


@lru_cache
def _part_materials() -> dict[tuple[str, str], PartMaterial]:
    return {
        (row["category"], row["part"]): PartMaterial(
            row["material"],
            float(row["hollow"] or 1.0),
            1e-3 * float(row["wall_mm"] or 0.0) * float(row["faces"] or 1.0),
        )
        for row in csv_rows("parts")
    }


@lru_cache
def _mechanisms() -> dict[tuple[str, str, str], PartMechanism]:
    rows = typed_rows("mechanisms", PartMechanism)
    return {(row["part"], row["category"], row["motion"]): found for row, found in rows}
