"""Which joint carries which part, which of several like parts an ordinal or a side names, and what they are made of."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from asset2sim.guidance import tables
from asset2sim.guidance.lexicon import Segment, place_of, singular
from asset2sim.guidance.object_info import JointInfo, LinkInfo, ObjectInfo, Vector
from asset2sim.guidance.tables import PartMechanism
from schemas.guidance import AskedMaterial, AskedWeight

ROLLS_SHARE = 0.5
"""Share of the object's height up to which a wheel's lowest point may lie for it to roll on the ground: they are drawn
small, large, and on things that lie."""
WHICH_ONE = {
    *("left", "right", "top", "bottom", "front", "back", "rear", "upper", "lower", "middle", "center"),
    *("inner", "outer"),
    *("main", "root", "first", "second", "third", "fourth", "region", "side", "small", "large", *"abclrxyz"),
    *("link", "joint", "hinge", "slide", "rail", "body", "part", "mesh", "visual", "obj", "group", "mechanism"),
    *("revolute", "prismatic", "continuous", "rotation", "translation", "motion"),
}
"""Last words of names that say which part, or how it moves, and not what it is."""
LIES_SHARE = 0.5
"""Height of a wheel over its shorter edge along the ground, below which it lies flat."""
THUMB_TURN_SHARE = 0.018
"""Most longest edge of a thumb turn, as a share of its door's height, 2 m: those of bolts are 0.02 to 0.035 m, and
knobs that work a latch 0.05 to 0.065 m across (makers' data)."""
HOLDS_PARTS = {"frame", "base", "case", "housing", "holder", "bracket", "mount", "board", "cabinet", "bodyset"}
"""Last words of what a part is on: a door's frame is no door; EusLisp's links are the object's name and "bodyset"."""
JOINED = 5
"""Least letters of a label that is looked for within a word, as in "gasknob"."""
LEVER_SHARE = 0.35
"""Most extent of a handle along its hinge, as a share of its longest across it, for it to be a lever or a bar on a
spindle: a bail hangs between two pins."""
PRESSED_SHARE, BUTTON_SHARE = 0.05, 0.25
"""Most travel of a button, which is also less than its own longest edge, and that edge, over the object's longest."""
PRESSED = ("button", "key")
"""Parts that are pressed in and come out again."""
AT_END, EITHER_WAY = 0.01, 0.02
"""Shares of a button's travel: drawn so near to an end it is drawn there, and by so much its ways to both sides may
differ for it to be pushed to either."""
EITHER_SIDE = 0.2
"""Difference of a lid's ways to either side, as a share of its range, up to which it swings."""
LEAF_THIN, LEAF_SHARE = 0.2, 0.25
"""Thickness of a leaf over its second longest edge, at most, and that edge over the object's longest, at least."""
UP = 2
"""Index of the vertical among the axes of the root's frame."""
BEFORE_SHARE = 0.25
"""Share of its body's depth by which a door hangs before the body's middle at least, for that side to be the front."""
AJAR = 0.2
"""Share of its range by which a door may be drawn open and stands where its frame's front is."""
ANY_VOTE = 0.5
"""Parts, each of which counts 1, that show a front at least."""
ROW_SHARE = 0.15
"""Parts whose centres differ by less than this share of the object's height stand in one row."""


@dataclass(frozen=True)
class MovablePart:
    """A joint with what it carries: ``name`` is a part of the tables or "", ``link`` the one with the geometry."""

    joint: JointInfo
    link: LinkInfo | None
    name: str
    mechanism: PartMechanism

    @property
    def center(self) -> Vector:
        """Centre of the part at rest in the root frame, m."""
        return self.link.center_m if self.link is not None else (0.0, 0.0, 0.0)

    @property
    def extent(self) -> float:
        """The volume of the part's box, m³."""
        return math.prod(self.link.box_m) if self.link is not None else 0.0


def parts_of(info: ObjectInfo, category: str) -> tuple[MovablePart, ...]:
    """A part per movable joint, in the order of the joints."""
    found = []
    for joint in info.joints:
        link = carried_link(info, joint)
        name = part_name(link.label if link else "", joint.child, joint.name)
        if name == "wheel" and link is not None and not rolls(info, link):
            name = "handwheel"
        if name == "knob" and link is not None and max(link.box_m) < THUMB_TURN_SHARE * max(info.size_closed_m):
            name = "thumb turn" if category == "Door" else name
        if link is not None:
            along = [abs(share) for share in joint.axis]
            across = [edge for edge, share in zip(link.box_m, along, strict=True) if share < max(along)]
            extent = link.box_m[along.index(max(along))] / max(max(across, default=0.0), 1e-9)
            name = held_as(name, category, joint.motion, extent)
            shaped = shape_name(joint.type, joint.axis, link.box_m, info.size_closed_m, joint.lower, joint.upper)
            name = by_shape(name, shaped, category, link.label, joint.child, joint.name)
        name = swinging(name, category, joint.type, joint.lower, joint.upper)
        found.append(MovablePart(joint, link, name, tables.mechanism(name, category, joint.motion)))
    return tuple(found)


def held_as(name: str, category: str, motion: str, extent: float) -> str:
    """The part, a "lever" for a handle that no row of its category knows and that is flat along its hinge: ``extent``
    is how far it reaches along, over how far across."""
    usual = tables.mechanism(name, category, motion) is tables.mechanism(name, "*", motion)
    return "lever" if name == "handle" and usual and motion != "slider" and extent < LEVER_SHARE else name


def by_shape(name: str, shaped: str, category: str, *called: str) -> str:
    """The part, ``shaped`` where nothing names it: and a "door" where it hangs upright and is a cover, flap or hatch,
    which are lids where they lie, as a door does of a ``category`` that has lids; ``called`` are its label and names,
    by which a laptop's base is no lid."""
    if any(words[-1] in HOLDS_PARTS - {"bodyset"} for text in called if (words := re.findall(r"[a-z]+", text.lower()))):
        return name
    upright = name == "lid" and shaped == "door" and not any("lid" in text.lower() for text in called)
    lies = name == "door" and shaped == "lid" and tables.has_part(category, "lid")
    return shaped if upright or lies or not name else name


def is_switch(part: str, mechanism: str) -> bool:
    """Whether a part with a mechanism of this kind is a switch or a tap's handle: on at one end, off at the other."""
    return part == "rocker" or mechanism == "bistable"


def swinging(name: str, category: str, motion: str, lower: float | None, upper: float | None) -> str:
    """The part, a "swing lid" for a lid on a hinge (``motion`` its joint's type, limits in rad) that opens as far to
    either side of where it is drawn, where objects of its category have such."""
    if name != "lid" or motion != "revolute" or lower is None or upper is None or not lower < 0.0 < upper:
        return name
    swings = tables.mechanism("swing lid", category, "hinge").role == "roll"
    return "swing lid" if swings and abs(lower + upper) <= EITHER_SIDE * (upper - lower) else name


def shape_name(
    motion: str, axis: Vector, box_m: Vector, whole_m: Vector, lower: float | None, upper: float | None
) -> str:
    """The part that one without a name is by its shape: a large thin leaf on a hinge in its plane is a "door", or where
    it lies level a "lid"; a small one that slides by less than its own size is a "button"; else "". ``motion`` is its
    joint's type, ``whole_m`` the object's edges, its limits in rad or m."""
    if motion == "prismatic" and lower is not None and upper is not None:
        most = min(PRESSED_SHARE * max(whole_m), max(box_m))
        return "button" if 0.0 < upper - lower <= most and max(box_m) <= BUTTON_SHARE * max(whole_m) else ""
    thin = min(range(3), key=lambda edge: box_m[edge])
    second = sorted(box_m)[1]
    flat = box_m[thin] <= LEAF_THIN * second and second >= LEAF_SHARE * max(whole_m)
    if motion != "revolute" or not flat or abs(axis[thin]) > LEAF_THIN:
        return ""
    return "door" if thin != UP else "lid"


def drawn_pressed(part: str, motion: str, lower: float | None, upper: float | None) -> bool:
    """Whether a part is a button that slides between these limits (m), drawn part-way in, zero at neither end."""
    if part not in PRESSED or motion != "slider" or lower is None or upper is None:
        return False
    low, high = sorted((lower, upper))
    return min(-low, high) > AT_END * (high - low) and abs(low + high) > EITHER_WAY * (high - low)


def rolls(info: ObjectInfo, wheel: LinkInfo) -> bool:
    """Whether a wheel stands upright and low enough to roll on the ground; others are turned by hand."""
    if wheel.box_m[UP] < LIES_SHARE * min(wheel.box_m[:UP]):
        return False
    lowest = min(link.center_m[2] - link.box_m[2] / 2.0 for link in info.links if link.has_geometry)
    return wheel.center_m[2] - wheel.box_m[2] / 2.0 - lowest <= ROLLS_SHARE * info.size_m[2]


def part_name(label: str, *names: str) -> str:
    """The part that a label, or else the first of a link's and a joint's names that does, speaks of; else ""."""
    labels = tables.part_labels()
    return labels.get(label) or next((found for text in (label, *names) if (found := head_part(text))), "")


@lru_cache
def head_part(name: str) -> str:
    """The part that a compound name speaks of: its last word that says more than which one ("oven_door_left" is a door,
    "door_handle" a handle, "door_frame" none), or its last two together ("valve_wheel"); else ""."""
    labels, joined = tables.part_labels(), re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()
    words = re.findall(r"[a-z]+", joined)
    while len(words) > 1 and words[-1] in WHICH_ONE and "_".join(words[-2:]) not in labels:
        words.pop()
    if not words or words[-1] in HOLDS_PARTS:
        return ""
    two, *several = "_".join(words[-2:]), *(form for word in reversed(words) for form in (word, word.removesuffix("s")))
    inside = (label for word in reversed(words) for label in labels if len(label) >= JOINED and label in word)
    found = next(
        (form for form in (two, *several) if form in labels), next(inside, "door" if "door" in words[-1] else "")
    )
    return labels.get(found, "")


def carried_link(info: ObjectInfo, joint: JointInfo) -> LinkInfo | None:
    """The joint's child, or where that is a bare helper the first labelled link that hangs from it."""
    seen: set[str] = set()
    name = joint.child
    while name not in seen:
        seen.add(name)
        link = info.link_by_name.get(name)
        if link is not None and (link.has_geometry or link.label):
            return link
        below = [child for parent, child in info.edges if parent == name]
        if not below:
            return link
        name = below[0]
    return None


def parts_named(parts: Sequence[MovablePart], word: str) -> tuple[MovablePart, ...]:
    """The parts that a word names: the first of its choices in the table of which the object has any."""
    for choice in tables.part_words().get(word, ()):
        if choice.startswith("@"):
            motion = {"@hinge": "hinge", "@slider": "slider"}.get(choice)
            mains = main_parts(parts)
            return tuple(part for part in mains if motion in (None, part.joint.motion)) or mains
        found = tuple(part for part in parts if part.name == choice)
        if found:
            return found
    return ()


def main_parts(parts: Sequence[MovablePart]) -> tuple[MovablePart, ...]:
    """The parts that open and close; where there are none, the caps, then the rest."""
    for roles in (("main",), ("cap",), ("roll", "control", "minor")):
        found = [part for part in parts if part.mechanism.role in roles]
        if found:
            # A joint that carries the body itself ("free" to the root) is no lid or door.
            return tuple([part for part in found if part.name] or found)
    return ()


def outermost_parts(info: ObjectInfo, chosen: Sequence[MovablePart]) -> tuple[MovablePart, ...]:
    """The chosen parts without those that hang from another of them, whose motion would be added to theirs."""
    children = {part.joint.child for part in chosen}
    return tuple(part for part in chosen if not _hangs_from(info, part.joint.parent, children))


_ENDS = {"0": True, "top": True, "-1": False, "bottom": False}
"""Ordinals from which several are counted, and whether forwards in reading order."""


def ordinal_candidates(
    info: ObjectInfo,
    candidates: Sequence[MovablePart],
    ordinals: Sequence[str],
    parts: Sequence[MovablePart],
    count: int = 1,
) -> tuple[MovablePart, ...]:
    """Candidates that ordinals name, in reading order: top row first, each from left to right as seen from the front.
    "top", "bottom", "left", "right" and "middle" filter by place, numbers then count what is left, or where that is
    too little, all from there: "the second from the top". With a ``count`` of several, the first or last so many: "the
    top two"."""
    chosen = reading_order(info, candidates, parts)
    if count > 1 and ordinals and ordinals[0] in _ENDS:
        return tuple(chosen[:count] if _ENDS[ordinals[0]] else chosen[-count:])
    for side in (ordinal for ordinal in ordinals if not _counts(ordinal)):
        chosen = _at_side(info, chosen, side, parts)
    numbers = [int(ordinal) for ordinal in ordinals if _counts(ordinal)]
    if not numbers:
        return tuple(chosen)
    if max(numbers) >= len(chosen) and {"top", "bottom"} & set(ordinals):
        whole = reading_order(info, candidates, parts)
        chosen = whole if "top" in ordinals else whole[::-1]
    return tuple(chosen[number] for number in numbers if -len(chosen) <= number < len(chosen))


def reading_order(
    info: ObjectInfo, candidates: Sequence[MovablePart], parts: Sequence[MovablePart]
) -> list[MovablePart]:
    """Top to bottom in rows, each from left to right as seen from the front."""
    row = max(ROW_SHARE * info.size_m[2], 1e-9)
    rest = sorted(candidates, key=lambda part: -part.center[2])
    ordered: list[MovablePart] = []
    while rest:
        level = rest[0].center[2]
        in_row = [part for part in rest if level - part.center[2] <= row]
        ordered += sorted(in_row, key=lambda part: _rightness(part, info, parts))
        rest = [part for part in rest if level - part.center[2] > row]
    return ordered


def shown_front(info: ObjectInfo, parts: Sequence[MovablePart]) -> tuple[float, float] | None:
    """(x, y) of the direction in which the object faces, along one axis: where drawers slide and doors stand, and of a
    door in the middle of its frame one of its two sides. None where no part shows it."""
    shown, through = [0.0, 0.0], [0.0, 0.0]
    body = info.body
    for part in parts:
        if part.joint.motion == "slider" and part.name in ("drawer", "shelf"):
            sign = math.copysign(1.0, part.joint.open - part.joint.closed)
            shown = [total + sign * share for total, share in zip(shown, part.joint.axis[:2], strict=True)]
        elif part.name == "door" and part.link is not None and body is not None:
            if abs(part.joint.zero - part.joint.closed) > AJAR * part.joint.range:
                continue
            before = [(part.center[i] - body.center_m[i]) / max(body.box_m[i], 1e-9) for i in (0, 1)]
            across = 0 if part.link.box_m[0] <= part.link.box_m[1] else 1
            through[across] -= 1.0
            if part.link.box_m[across] > LEAF_THIN * part.link.box_m[1 - across]:
                across = max((0, 1), key=lambda i: abs(before[i]))  # the door of a safe may be deeper than it is wide
            if abs(before[across]) >= BEFORE_SHARE:
                shown[across] += math.copysign(1.0, before[across])
    x, y = shown if math.hypot(*shown) >= ANY_VOTE else through
    if math.hypot(x, y) < ANY_VOTE:
        return None
    return (math.copysign(1.0, x), 0.0) if abs(x) >= abs(y) else (0.0, math.copysign(1.0, y))


def front_direction(info: ObjectInfo, parts: Sequence[MovablePart]) -> tuple[float, float]:
    """(x, y) of the direction in which the object faces; where no part shows it, −x, as in PartNet-Mobility."""
    return shown_front(info, parts) or (-1.0, 0.0)


def depth_width_height(info: ObjectInfo) -> Vector:
    """The edges of the closed object as seen from where its parts show its front, m; its depth is along x without."""
    x, y, z = info.size_closed_m
    return (y, x, z) if front_direction(info, parts_of(info, info.category))[1] else (x, y, z)


def _rightness(part: MovablePart, info: ObjectInfo, parts: Sequence[MovablePart]) -> float:
    forward_x, forward_y = front_direction(info, parts)
    return part.center[0] * -forward_y + part.center[1] * forward_x


def _at_side(info: ObjectInfo, chosen: list[MovablePart], side: str, parts: Sequence[MovablePart]) -> list[MovablePart]:
    if not chosen:
        return []
    if side == "middle":
        return [chosen[len(chosen) // 2]] if len(chosen) % 2 else chosen[len(chosen) // 2 - 1 :][:1]
    vertical = side in ("top", "bottom")
    key = (lambda part: part.center[2]) if vertical else (lambda part: _rightness(part, info, parts))
    values = [key(part) for part in chosen]
    best = max(values) if side in ("top", "right") else min(values)
    slack = ROW_SHARE * (info.size_m[2] if vertical else max(info.size_m[:2]))
    return [part for part, value in zip(chosen, values, strict=True) if abs(value - best) <= slack]


def _counts(ordinal: str) -> bool:
    return ordinal.lstrip("-").isdigit()


def _hangs_from(info: ObjectInfo, link: str, ancestors: set[str]) -> bool:
    seen: set[str] = set()
    while link not in seen:
        if link in ancestors:
            return True
        seen.add(link)
        link = info.parent_of.get(link, link)
    return False


_ABOUT_MOTION = ("damping", "damped", "friction")


def asked_materials(parts: Sequence[MovablePart], statements: Sequence[Segment]) -> tuple[AskedMaterial, ...]:
    """The first material of each part that is named with one ("glass door"), and of the whole object."""
    table, found = tables.material_words(), dict[str, AskedMaterial]()
    for segment in statements:
        for index, token in enumerate(segment.tokens):
            material = table.get(token)
            if material is None or (token == "steel" and "stainless" in segment.tokens[max(index - 1, 0) : index]):
                continue
            following = segment.tokens[index + 1 : index + 3]
            if segment.tokens[index : index + 2] in tables.nouns():  # a paper cutter is of no paper
                continue
            owner = next((p.name for word in following for p in parts_named(parts, singular(word)) if p.name), "")
            if not (owner and any({word, singular(word)} & tables.part_words().keys() for word in following)):
                owner = ""
            if owner or segment.sentence == 0:
                found.setdefault(owner, AskedMaterial(part=owner, material=material, **place_of(segment)))
    return tuple(found.values())


def asked_weights(parts: Sequence[MovablePart], statements: Sequence[Segment]) -> tuple[AskedWeight, ...]:
    """The links of the parts that are called heavy or light."""
    return tuple(
        AskedWeight(link=part.link.name, heavy=item.kind == "heavy", **place_of(segment))
        for segment in statements
        if not segment.of(*_ABOUT_MOTION)
        for item in segment.of("heavy", "lightweight")
        for word in segment.of("part", "parts")
        for part in parts_named(parts, word.value)
        if part.link is not None
    )
