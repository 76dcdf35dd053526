"""How each link is built: a wall or a solid, of what, and what is inside; the object's mass follows from its parts."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from asset2sim.guidance import tables
from asset2sim.guidance.object_info import LinkInfo, ObjectInfo
from asset2sim.guidance.parts import MovablePart, front_direction, part_name
from asset2sim.guidance.tables import Size
from asset2sim.physics.inertia import wall_volume
from schemas.guidance import AskedMass, Guidance
from schemas.overlay import Content, LinkProposal, MassChange

LEAST_EXPONENT, MOST_EXPONENT = 1.0, 3.0
"""Mass over length among products of one kind: one that is only longer (1) to one that is larger all round (3) ..."""
SHRUNK_EXPONENT = 2.0
"""... and one that a word like "small" shrinks all round, at walls of the same thickness (2) to thinner ones (3)."""
CONTENT_EXPONENT = 2.0
"""The same of motors, batteries and boards: they follow what the object carries, cleans or heats."""
FOOT = 0.05
"""Height, as a share of a link's, up to which contents lie in the lowest link: the weight in a lamp's foot."""
WALL_EXPONENT = 0.5
"""Thickness over length of an object smaller than the usual: half way between the same wall and one to scale."""
DEPTH_M, LEAST_DEPTH, DEPTH_EXPONENT = 0.03, 0.01, 0.25
"""Hull over area, m, of a thing of no known kind whose wall is its row's (a cube of 0.18 m), the least share of it that
counts (sheets), and the wall's thickness over it: what weighs 45 known kinds best as if none were known."""
CASTOR_M, AIR_EXPONENT = 0.1, 0.5
"""Diameter up to which a wheel is as its row says, and what larger ones have less: of their disc, wheels of bins of
0.2 m have 450 kg/m³ in place of 660, of wheelchairs of 0.6 m 250 (1.8 to 2.4 kg), of cars 300 (makers' data)."""
MIN_HOLLOW = 1e-3
LEAST_WALL_M = 1e-4
"""Thinnest wall that is proposed, m: foil."""
TINY_KG = (3e-4, 1e-2)
"""Buttons and keys weigh 0.3 g (a remote's rubber dome) to 10 g (a space bar, a dishwasher's knob)."""
CAP_M = 0.2
"""Longest edge of a closure, m: what is wider and called a cap is a lid, of a bucket or a machine."""
HEAVY, LIGHT = 1.25, 0.75
"""What "heavy" and "lightweight" do to a mass."""
_TINY = ("button", "key")
_GRIPPED = ("handle", "knob", "lever", "selector", "handwheel", "lock")
"""Parts that are cast or of bar, not pressed from sheet: of metal their walls are no thinner than moulded ones."""
WIRE_KG_M, GRIP_M = 0.099, 0.07
"""Least mass over length of a handle that four fingers close on (m): a steel wire of 4 mm, as of a bucket's bail."""
_FRAME = ("", "leg")
"""Parts that carry what a known total has more than its parts, where no row says how such an object is built."""
_PLASTICS = ("plastic", "polypropylene", "polyethylene", "pvc")
_ALIKE = (_PLASTICS, ("steel", "stainless steel", "aluminium", "brass", "iron"),
          ("wood", "particleboard", "hollow-core board"))  # fmt: skip
"""Materials of which a file's paint means any by the name of one: "metal", "wood"."""
_UNCHANGED_MATERIALS = ("electronics", "glass", "rubber")
"""Materials that a word about the whole object does not change: a steel watch keeps its glass."""


@dataclass(frozen=True)
class _Piece:
    link: LinkInfo
    part: str
    material: str
    hollow: float
    wall_m: float = 0.0
    contents: tuple[Content, ...] = ()
    fixed: bool = False
    unknown: bool = False
    """Whether it is the casing of an object of no known kind."""

    def mass(self, scale: float) -> float:
        return link_mass(self.link, self.proposal(), scale)

    def times(self, factor: float) -> "_Piece":
        """The piece with its masses multiplied, as far as material goes."""
        inside = tuple(item.model_copy(update={"mass_kg": item.mass_kg * factor}) for item in self.contents)
        hollow = min(max(self.hollow * factor, MIN_HOLLOW), 1.0)
        wall = max(self.wall_m * factor, LEAST_WALL_M) if self.wall_m else 0.0
        return replace(self, hollow=hollow, wall_m=wall, contents=inside)

    def proposal(self) -> LinkProposal:
        return LinkProposal(
            name=self.link.name,
            material=self.material,
            density_kg_m3=tables.materials()[self.material].density_kg_m3,
            hollow_factor=None if self.wall_m else _four_digits(self.hollow),
            wall_m=_four_digits(self.wall_m) or None,
            contents=tuple(c.model_copy(update={"mass_kg": _four_digits(c.mass_kg)}) for c in self.contents),
        )


def propose_links(
    info: ObjectInfo, parts: Sequence[MovablePart], guidance: Guidance, scale: float, final_m: float
) -> tuple[tuple[LinkProposal, ...], tuple[str, ...], MassChange | None]:
    """Every link that has geometry as built, notes on what was matched and adjusted, and how the parts' masses were
    brought to a usual or stated total, None where they were not."""
    size = tables.sizes()[guidance.category]
    names = {part.link.name: part.name for part in parts if part.link is not None}
    asked = {wish.part: wish.material for wish in guidance.materials}
    shaped = [link for link in info.links if link.has_geometry]
    ratio = final_m / size.typical_m if final_m > 0.0 else 1.0
    called = {link.name: names.get(link.name) or fixed_part(info, link, names) for link in shaped}
    wide = {link.name for link in shaped if max(link.box_m) * scale > CAP_M}
    called |= {name: "lid" for name, part in called.items() if part == "cap" and name in wide}
    pieces = [_piece(link, called[link.name], size.category, asked, final_m) for link in shaped]
    notes = []
    changed = sorted({piece.material for piece in pieces if piece.material in asked.values()})
    if changed:
        notes.append(f"material: {' and '.join(changed)} from the guidance")
    pieces = [_as_deep(piece, scale) if piece.unknown else _thinner(piece, ratio) for piece in pieces]
    pieces = _with_contents(pieces, size.category, info, parts, ratio)
    pieces = [_airy(piece, scale) if piece.part == "wheel" else piece for piece in pieces]
    pieces = [_tiny(piece, scale) if piece.part in _TINY else piece for piece in pieces]
    pieces = [_firm(piece, scale) if piece.part == "handle" else piece for piece in pieces]
    factors = {wish.link: HEAVY if wish.heavy else LIGHT for wish in guidance.weights}
    pieces = [p.times(factors[p.link.name]) if p.link.name in factors else p for p in pieces]
    usual = _usual_masses(size, pieces, ratio, scale) if guidance.mass is None else _stated_mass(guidance.mass)
    hung = [p for p in pieces if p.part not in _FRAME] if size.category == "Door" and not usual.asked else []
    pieces, around = (hung, [p for p in pieces if p not in hung]) if _leaves(hung) else (pieces, [])
    if not usual.asked and not tables.is_built(size.category) and sum(p.mass(scale) for p in pieces) < usual.low:
        pieces = [p if p.part in _FRAME else replace(p, fixed=True) for p in pieces]
    pieces, note, change = _fitted(pieces, scale, usual)
    pieces = pieces if tables.is_built(size.category) else _filled(pieces, scale, usual.low)
    notes.append(note)
    pieces = [*pieces, *around]
    return tuple(piece.proposal() for piece in pieces), tuple(notes), change


def fixed_part(info: ObjectInfo, link: LinkInfo, names: Mapping[str, str]) -> str:
    """The part that a link is which no joint moves: by its label, or where it is fixed to a part (``names`` maps link →
    part of those that move), by its name or else that part; else ""."""
    part, on = part_name(link.label), link.name
    while not part and on not in names and on in info.parent_of:
        on = info.parent_of[on]
    return part or (part_name("", link.name) or names[on] if on in names else "")


def link_mass(link: LinkInfo, proposal: LinkProposal, scale: float) -> float:
    """The mass that validation gives a link for a proposal of material, wall or hollow factor, and contents, kg."""
    if proposal.wall_m and link.outer_m2 > 0.0:
        volume = wall_volume(
            link.outer_m2 * scale**2, proposal.wall_m, link.hull_volume_m3 * scale**3, math.hypot(*link.box_m) * scale
        )
    else:
        share = 1.0 if proposal.hollow_factor is None else proposal.hollow_factor
        volume = (link.volume_m3 or link.hull_volume_m3) * scale**3 * share
    return volume * (proposal.density_kg_m3 or 0.0) + sum(item.mass_kg for item in proposal.contents)


def _piece(link: LinkInfo, part: str, category: str, words: Mapping[str, str], longest_m: float) -> _Piece:
    unknown = category == tables.UNKNOWN and part in tables.CASING
    row = tables.unknown_casing(longest_m) if unknown else tables.part_material(category, part)
    material, hollow, wall = row.material, row.hollow, row.wall_m
    wanted = words.get(part) or words.get("")
    same = wanted == material or (wanted == "plastic" and material in _PLASTICS)
    if wanted is None and (named := painted_material(link.covers, category)):
        wanted, same = named, not unknown and any({named, material} <= {*alike} for alike in _ALIKE)
    if wanted and not same and (part in words or material not in _UNCHANGED_MATERIALS):
        table = tables.materials()
        thicker = table[wanted].wall_factor / table[material].wall_factor
        thicker = max(thicker, 1.0) if part in _GRIPPED else thicker
        hollow, wall, material = hollow * thicker, wall * thicker, wanted
    # The table's share is that of the link's hull; a mesh that models its walls has less volume than its hull.
    if link.hull_volume_m3 > 0.0 and link.volume_m3 > 0.0:
        hollow *= link.hull_volume_m3 / link.volume_m3
    hollow, wall = min(max(hollow, MIN_HOLLOW), 1.0), wall if link.outer_m2 > 0.0 else 0.0
    return _Piece(link, part, material, hollow, wall, unknown=unknown)


def painted_material(covers: Sequence[str], category: str) -> str:
    """The material after which a file names the paint of most of a link ("dark grey (black_metal), 80 %"); "" where its
    name says none, or is the object's own ("glass" of a wine glass)."""
    if not covers or ((share := _SHARE.search(covers[0])) is not None and float(share[1]) < MOST_OF_IT):
        return ""
    name = _NAMED.search(covers[0])
    tokens = re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name[1] if name else "").lower())
    table = tables.material_words()
    found = [table[token] for token in tokens if token in table and token not in category.lower()]
    return "stainless steel" if "stainless steel" in found else next(iter(found), "")


_NAMED, _SHARE = re.compile(r"\(([^()]+)\)"), re.compile(r", (\d+) %$")
"""A paint's name, and its share of the link's area in percent, in the words that say what covers a link."""
MOST_OF_IT = 60.0
"""Share of a link's area, in percent, from which a paint may name what the link is made of."""


def _thinner(piece: _Piece, ratio: float) -> _Piece:
    return replace(piece, wall_m=piece.wall_m * min(ratio, 1.0) ** WALL_EXPONENT)


def _as_deep(piece: _Piece, scale: float) -> _Piece:
    """The piece with a wall that is thicker the deeper it is, by its hull's volume over its area."""
    link = piece.link
    deep = scale * link.hull_volume_m3 / link.outer_m2 if link.outer_m2 > 0.0 else 0.0
    return replace(piece, wall_m=piece.wall_m * max(deep / DEPTH_M, LEAST_DEPTH) ** DEPTH_EXPONENT)


def _airy(piece: _Piece, scale: float) -> _Piece:
    """A wheel with its share of air: castors are solid, tyres are not."""
    across = max(piece.link.box_m) * scale
    return replace(piece, hollow=piece.hollow * min(CASTOR_M / across, 1.0) ** AIR_EXPONENT) if across > 0.0 else piece


def _with_contents(
    pieces: Sequence[_Piece], category: str, info: ObjectInfo, parts: Sequence[MovablePart], ratio: float
) -> list[_Piece]:
    """The pieces with what is inside them: of several links of one part, in the largest, a foot's in the lowest."""
    forward, side = front_direction(info, parts)
    alike = {part: [p.link for p in pieces if p.part == part] for part in {piece.part for piece in pieces}}
    largest = {part: max(links, key=lambda link: link.hull_volume_m3).name for part, links in alike.items()}
    lowest = {part: min(links, key=lowest_height).name for part, links in alike.items()}
    filled = []
    for piece in pieces:
        inside = [
            item
            for item in tables.part_contents(category, piece.part)
            if (lowest if item.height <= FOOT else largest)[piece.part] == piece.link.name
        ]
        contents = tuple(
            Content(
                name=item.name,
                mass_kg=item.mass_kg * ratio**CONTENT_EXPONENT,
                at=(0.5 + forward * (0.5 - item.depth), 0.5 + side * (0.5 - item.depth), item.height),
            )
            for item in inside
            if not largest.keys() & set(item.unless) and (not item.only or item.only in largest)
        )
        filled.append(replace(piece, contents=contents))
    return filled


def lowest_height(link: LinkInfo) -> float:
    """The lowest height of a link, m at the authored scale; infinite where it has no shape."""
    return link.center_m[2] - link.box_m[2] / 2.0 if link.has_geometry else math.inf


def _tiny(piece: _Piece, scale: float) -> _Piece:
    mass = piece.mass(scale)
    if mass <= 0.0:
        return piece
    wanted = min(max(mass, TINY_KG[0]), TINY_KG[1])
    return replace(piece.times(wanted / mass), fixed=True)


def _firm(piece: _Piece, scale: float) -> _Piece:
    length, mass = max(piece.link.box_m) * scale, piece.mass(scale)
    if length < GRIP_M or mass <= 0.0:
        return piece
    return piece.times(max(WIRE_KG_M * length / mass, 1.0))


@dataclass(frozen=True)
class _MassRange:
    """The masses, kg, that an object may have, and why: ``asked`` says that its user states the only one."""

    low: float
    high: float
    why: str
    asked: bool = False


def _leaves(pieces: Sequence[_Piece]) -> int:
    """The number of leaves. Doors are weighed by the leaf: frames, and walls about them, are no part of that."""
    return sum(piece.part == "door" for piece in pieces)


def _stated_mass(wish: AskedMass) -> _MassRange:
    return _MassRange(wish.mass_kg, wish.mass_kg, "the guidance", asked=True)


def _usual_masses(size: Size, pieces: Sequence[_Piece], ratio: float, scale: float) -> _MassRange:
    """The usual masses of an object ``ratio`` times as long as the typical one, whose body may be of another material
    than usual. Where no row says how such objects are built, the middle is the least: walls alone are too light."""
    least = LEAST_EXPONENT if scale == 1.0 else SHRUNK_EXPONENT
    ends = (ratio**least, ratio**MOST_EXPONENT)
    body = max(pieces, key=lambda piece: piece.mass(scale), default=None)
    usual = tables.part_material(size.category, "" if body is None else body.part).material
    other = 1.0
    if body is not None and body.part in ("", "door") and body.material != usual:
        table = tables.materials()
        other *= table[body.material].density_kg_m3 * table[body.material].wall_factor
        other /= table[usual].density_kg_m3 * table[usual].wall_factor
    leaves = max(_leaves(pieces), 1) if size.category == "Door" else 1
    low, high = size.mass_min_kg * min(ends) * other, size.mass_max_kg * max(ends) * other * leaves
    if not tables.is_built(size.category):
        low = max(low, math.sqrt(size.mass_min_kg * size.mass_max_kg) * ratio**CONTENT_EXPONENT * other)
    return _MassRange(low, high, f"{size.category} of {ratio * size.typical_m:.3g} m")


def _fitted(pieces: list[_Piece], scale: float, usual: _MassRange) -> tuple[list[_Piece], str, MassChange | None]:
    total = sum(piece.mass(scale) for piece in pieces)
    fixed = sum(piece.mass(scale) for piece in pieces if piece.fixed)
    free, bounds = total - fixed, f"{usual.low:.3g} to {usual.high:.3g} kg for {usual.why}"
    wanted = min(max(total, usual.low), usual.high)
    if free <= 0.0 or usual.low <= total <= usual.high:
        return pieces, f"mass: {total:.3g} kg from the parts, within {bounds}", None
    factor = max(wanted - fixed, 0.1 * wanted) / free
    fitted = [p if p.fixed else p.times(factor) for p in pieces]
    reached = sum(piece.mass(scale) for piece in fitted)
    change = MassChange(from_kg=_four_digits(total), to_kg=_four_digits(reached), why=bounds, asked=usual.asked)
    return fitted, f"mass: {total:.3g} kg from the parts, brought to {reached:.3g} kg: {bounds}", change


def _filled(pieces: Sequence[_Piece], scale: float, least: float) -> list[_Piece]:
    """The pieces, the largest of the frame with what a ``least`` mass (kg) has more than they have: motor, fittings."""
    missing = least - sum(piece.mass(scale) for piece in pieces)
    frame = max((p for p in pieces if p.part in _FRAME), key=lambda piece: piece.link.hull_volume_m3, default=None)
    if frame is None or missing < 0.01 * least:
        return list(pieces)
    inside = Content(name="motor and fittings", mass_kg=missing, at=(0.5, 0.5, 0.4))
    return [replace(p, contents=(*p.contents, inside)) if p is frame else p for p in pieces]


def _four_digits(value: float) -> float:
    return float(f"{value:.4g}")
