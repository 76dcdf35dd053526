"""How parts are to move, in words: damping, friction, springs, soft closing; times, distances and forces stated."""

from collections.abc import Iterator, Mapping, Sequence

from asset2sim.guidance.clauses import NO_MENTION, mentioned_parts
from asset2sim.guidance.lexicon import Item, Segment, place_of
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import MovablePart, main_parts
from schemas.guidance import AskedMotion

_NEAR, _FAR = 3, 6
"""Words between a level and its noun: "low hinge damping", "the damping of the hinge is low"."""
_KINDS = (
    "damping", "damped", "friction", "free", "slow", "smooth", "hold", "spring", "stiff", "soft", "light",
    "soft close", "slam", "glide", "snap", "slow return", "closing", "returning", "stops", "turns",
    "force", "torque", "latch", "seal",
)  # fmt: skip
_TURNING = frozenset(
    ("turn", "turns", "turning", "spin", "spins", "spinning", "rotate", "rotates", "swivel", "swivels")
)
"""Words after which a statement is about what turns."""
_SHUTTING = ("closing", "soft close", "slam")
_BORNE = frozenset((
    "capacity", "load", "loads", "payload", "rated", "carries", "carry", "bears", "bear", "supports", "support",
    "lifts", "withstands", "holds", "hold",
))  # fmt: skip
"""Words after which a force is what something bears or lifts, and not what a hand needs."""
_CATCHES = frozenset(("latch", "catch", "lock", "clasp"))
"""Names of a door's catch: where it is no link of its own, words about it are about the door."""
_RETURNING = ("returning", "spring", "snap", "slow return")
"""Kinds of words beside which a time says how long the part takes to shut, or to come back."""


def asked_motions(
    info: ObjectInfo, parts: Sequence[MovablePart], statements: Sequence[Segment]
) -> tuple[AskedMotion, ...]:
    """The wishes about motion, in the order of the sentence."""
    found = []
    for subject, segment in _clauses(info, parts, statements):
        changes = _changes(segment)
        named = tuple(part.joint.name for part in subject)
        joints = tuple(part.joint.name for part in _affected_parts(subject, changes, segment))
        if subject and changes:
            found.append(AskedMotion(joints=joints, named=named, changes=changes, **place_of(segment)))
    return tuple(found)


def _clauses(
    info: ObjectInfo, parts: Sequence[MovablePart], statements: Sequence[Segment]
) -> Iterator[tuple[tuple[MovablePart, ...], Segment]]:
    """Segments about dynamics, each with the parts it names, else the next noun's, the last named or the main ones."""
    last = NO_MENTION
    for before, segment, after in zip((None, *statements), statements, (*statements[1:], None), strict=False):
        if before is not None and before.sentence != segment.sentence:
            last = NO_MENTION
        here = mentioned_parts(info, parts, segment, last)
        last = here if here.found else last
        if not segment.of(*_KINDS):
            continue
        if here.found and not here.parts and set(here.words) <= _CATCHES:
            here = NO_MENTION
        if not here.found and after is not None and after.sentence == segment.sentence and _adjective(segment, after):
            yield mentioned_parts(info, parts, after, last).parts, segment
        else:
            yield here.parts if here.found else last.parts or main_parts(parts), segment


def _affected_parts(
    subject: Sequence[MovablePart], changes: Mapping[str, str], segment: Segment
) -> tuple[MovablePart, ...]:
    """The parts that the changes apply to: a spring goes to parts that are pushed, not to those that only spin, and
    words about turning ("the seat turns freely") and torques not to those that slide: a seat's gas spring."""
    turned = tuple(part for part in subject if part.joint.motion != "slider")
    if (_TURNING & set(segment.tokens) or "torque" in changes) and turned:
        return turned
    pushed = tuple(part for part in subject if part.joint.motion != "spin")
    return pushed if "spring" in changes and pushed else tuple(subject)


def _changes(segment: Segment) -> dict[str, str]:
    """The changes that a segment asks for: kind → level or ""."""
    changes: dict[str, str] = {}
    negations = segment.of("not")
    for item in segment.of(*_KINDS):
        negated = any(0 <= item.start - other.end < _NEAR for other in negations)
        if item.kind in ("closing", "returning", "stops", "turns", "force", "torque"):
            continue
        if item.kind in ("damping", "damped", "friction"):
            level = "super low" if negated else _level(segment, item)
            if level is None and item.kind == "damped":
                level = "high"
            if level is not None:
                changes[item.kind.replace("damped", "damping")] = level
        elif item.kind == "light" and segment.of("damping", "friction"):
            continue
        else:
            changes[f"no {item.kind}" if negated else item.kind] = ""
    return changes | _measured(segment)


def _measured(segment: Segment) -> dict[str, str]:
    """The time that a segment states for closing or returning, s, the stopping distance, m or rad, and the force or
    torque that moves the part, N or N·m, as text."""
    found = {item.kind: f"{item.number:g}" for item in segment.of("stops", "turns")}
    for item in segment.of("force", "torque")[:1]:
        before = segment.tokens[: item.start - segment.start]
        if item.number > 0.0 and not _BORNE & set(before):
            found[item.kind] = f"{item.number:g}"
    for item in segment.of("time")[:1]:
        if segment.of(*_SHUTTING):
            found["closes"] = f"{item.number:g}"
        elif segment.of(*_RETURNING):
            found["returns"] = f"{item.number:g}"
    return found


def _level(segment: Segment, noun: Item) -> str | None:
    """The level that stands next to "damping" or "friction"; before it, else after it."""
    levels = segment.of("level", "light", "heavy")
    before = [item for item in levels if 0 <= noun.start - item.end < _NEAR]
    after = [item for item in levels if 0 <= item.start - noun.end < _FAR]
    found = before[-1] if before else after[0] if after else None
    return None if found is None else {"light": "low", "heavy": "high"}.get(found.kind, found.value)


def _adjective(segment: Segment, following: Segment) -> bool:
    """Whether a segment only opens a list of adjectives that the next one ends with its noun: "light, springy keys"."""
    own = segment.of(*_KINDS)
    return (
        len(own) == len(segment.items) == 1
        and own[0].kind in ("light", "soft", "stiff", "spring")
        and own[0].end - segment.start == len(segment.tokens)
        and bool(following.of("part", "parts"))
    )
