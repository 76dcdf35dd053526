"""Material and hollow factor of each link, such that the object's mass is usual for its category and size."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from asset2sim.models.language import tables
from asset2sim.models.language.lexicon import Segment, singular
from asset2sim.models.language.object_info import LinkInfo, ObjectInfo
from asset2sim.models.language.parts import MovablePart, part_name, parts_named
from asset2sim.models.language.tables import Size
from schemas.overlay import LinkProposal

SIZE_EXPONENT = 2.5
"""Mass over size among products of one kind: walls (2) to solids (3)."""
SHEET_M = 1e-3
"""Thickness that a link without volume is given, m."""
MIN_HOLLOW = 1e-3
TINY_KG = (1e-3, 1e-2)
"""Buttons and keys weigh 1 to 10 g (paper)."""
HEAVY, LIGHT = 1.25, 0.75
"""What "heavy" and "lightweight" do to a mass."""
_TINY = ("button", "key")
_PLASTICS = ("plastic", "polypropylene", "polyethylene", "pvc")
_UNCHANGED_MATERIALS = ("electronics", "glass", "rubber")
"""Materials that a word about the whole object does not change: a steel watch keeps its glass."""


@dataclass(frozen=True)
class _Piece:
    link: LinkInfo
    part: str
    material: str
    hollow: float
    fixed: bool = False

    def mass(self, scale: float) -> float:
        return material_volume(self.link) * scale**3 * tables.materials()[self.material].density_kg_m3 * self.hollow

    def proposal(self) -> LinkProposal:
        density, hollow = tables.materials()[self.material].density_kg_m3, float(f"{self.hollow:.4g}")
        return LinkProposal(name=self.link.name, material=self.material, density_kg_m3=density, hollow_factor=hollow)


def propose_links(
    info: ObjectInfo, size: Size, parts: Sequence[MovablePart], statements: Sequence[Segment], guidance: str,
    scale: float, final_m: float,
) -> tuple[tuple[LinkProposal, ...], tuple[str, ...]]:  # fmt: skip
    """Density and hollow factor of every link that has geometry, and notes on what was matched and adjusted."""
    names = {part.link.name: part.name for part in parts if part.link is not None}
    words = _materials(parts, statements)
    shaped = [link for link in info.links if link.has_geometry]
    pieces = [_piece(link, names.get(link.name) or part_name(link.label), size.category, words) for link in shaped]
    notes = []
    changed = sorted({piece.material for piece in pieces if piece.material in words.values()})
    if changed:
        notes.append(f"material: {' and '.join(changed)} from the guidance")
    pieces = [_tiny(piece, scale) if piece.part in _TINY else piece for piece in pieces]
    pieces = _weighted(pieces, parts, statements)
    low, high, why = _mass_range(size, pieces, guidance, final_m)
    pieces, note = _fitted(pieces, scale, low, high, why)
    notes.append(note)
    return tuple(piece.proposal() for piece in pieces), tuple(notes)


def material_volume(link: LinkInfo) -> float:
    """The volume that a density multiplies, m³ at the authored scale: as stated, or a sheet's where there is none."""
    return link.volume_m3 or link.hull_volume_m3 or link.area_m2 * SHEET_M


def _piece(link: LinkInfo, part: str, category: str, words: Mapping[str, str]) -> _Piece:
    row = tables.part_material(category, part)
    material, hollow = row.material, row.hollow
    wanted = words.get(part) or words.get("")
    same = wanted == material or (wanted == "plastic" and material in _PLASTICS)
    if wanted and not same and (part in words or material not in _UNCHANGED_MATERIALS):
        table = tables.materials()
        hollow *= table[wanted].wall_factor / table[material].wall_factor
        material = wanted
    # The table's share is that of the link's hull; a mesh that models its walls has less volume than its hull.
    if link.hull_volume_m3 > 0.0 and link.volume_m3 > 0.0:
        hollow *= link.hull_volume_m3 / link.volume_m3
    return _Piece(link, part, material, min(max(hollow, MIN_HOLLOW), 1.0))


def _materials(parts: Sequence[MovablePart], statements: Sequence[Segment]) -> dict[str, str]:
    """MovablePart → material where the guidance names both ("glass door"); "" → the material of the whole object."""
    table, found = tables.material_words(), dict[str, str]()
    for segment in statements:
        for index, token in enumerate(segment.tokens):
            material = table.get(token)
            if material is None or (token == "steel" and "stainless" in segment.tokens[max(index - 1, 0) : index]):
                continue
            following = segment.tokens[index + 1 : index + 3]
            owner = next((p.name for word in following for p in parts_named(parts, singular(word)) if p.name), "")
            if owner and any({word, singular(word)} & tables.part_words().keys() for word in following):
                found.setdefault(owner, material)
            elif segment.sentence == 0:
                found.setdefault("", material)
    return found


def _tiny(piece: _Piece, scale: float) -> _Piece:
    mass = piece.mass(scale)
    if mass <= 0.0:
        return piece
    wanted = min(max(mass, TINY_KG[0]), TINY_KG[1])
    return replace(piece, hollow=min(max(piece.hollow * wanted / mass, MIN_HOLLOW), 1.0), fixed=True)


def _weighted(pieces: list[_Piece], parts: Sequence[MovablePart], statements: Sequence[Segment]) -> list[_Piece]:
    factors: dict[str, float] = {}
    for segment in statements:
        for item in segment.of("heavy", "lightweight"):
            if segment.of("damping", "damped", "friction"):
                continue
            for part in (p for word in segment.of("part", "parts") for p in parts_named(parts, word.value)):
                if part.link is not None:
                    factors[part.link.name] = HEAVY if item.kind == "heavy" else LIGHT
    return [replace(p, hollow=min(p.hollow * factors.get(p.link.name, 1.0), 1.0)) for p in pieces]


def _mass_range(size: Size, pieces: Sequence[_Piece], guidance: str, final_m: float) -> tuple[float, float, str]:
    stated = re.search(r"(\d+(?:\.\d+)?)\s*(kg|kilograms?|kilos?|g|grams?)\b", guidance.lower())
    if stated and float(stated.group(1)) > 0.0:
        mass = float(stated.group(1)) * (1.0 if stated.group(2).startswith("k") else 1e-3)
        return mass, mass, "the guidance"
    ratio = (final_m / size.typical_m) ** SIZE_EXPONENT if final_m > 0.0 else 1.0
    usual = tables.part_material(size.category, "").material
    body = max(pieces, key=lambda piece: material_volume(piece.link), default=None)
    if body is not None and body.part == "" and body.material != usual:
        table = tables.materials()
        ratio *= table[body.material].density_kg_m3 * table[body.material].wall_factor
        ratio /= table[usual].density_kg_m3 * table[usual].wall_factor
    return (size.mass_min_kg * ratio, size.mass_max_kg * ratio, f"{size.category} of {final_m:.3g} m")


def _fitted(pieces: list[_Piece], scale: float, low: float, high: float, why: str) -> tuple[list[_Piece], str]:
    total = sum(piece.mass(scale) for piece in pieces)
    fixed = sum(piece.mass(scale) for piece in pieces if piece.fixed)
    free = total - fixed
    wanted = min(max(total, low), high)
    if free <= 0.0 or low <= total <= high:
        return (pieces, f"mass: {total:.3g} kg, within {low:.3g} to {high:.3g} kg for {why}")
    factor = max(wanted - fixed, 0.1 * wanted) / free
    fitted = [p if p.fixed else replace(p, hollow=min(max(p.hollow * factor, MIN_HOLLOW), 1.0)) for p in pieces]
    bounds = f"{low:.3g} to {high:.3g} kg for {why}"
    reached = sum(piece.mass(scale) for piece in fitted)
    return (fitted, f"mass: {total:.3g} kg from the parts, brought to {reached:.3g} kg: {bounds}")
