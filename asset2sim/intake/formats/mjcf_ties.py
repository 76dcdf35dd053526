"""Joints that MuJoCo's equalities tie to one another, by themselves or by fixed tendons, as joints that follow one."""

import math
from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import dataclass
from typing import Any

from lxml.etree import _Element as Element

from asset2sim.assets.urdf.edit import short_numbers
from asset2sim.intake.formats.format import add_child

SAME = 1e-9
"""Logarithm of a ratio below which two joints move alike."""


@dataclass(frozen=True)
class Tie:
    """Position of ``joint`` = ``ratio`` × that of ``leader`` + ``offset``, rad or m, from where both are drawn; a ratio
    of 0 holds it."""

    joint: str
    leader: str
    ratio: float
    offset: float


def read_ties(
    mujoco: Any, model: Any, name: Callable[[int], str], said: Set[int] = frozenset()
) -> tuple[list[Tie], list[str], int]:
    """The ties of a compiled model, whose joints have a ``name``; a note on each equality, but those ``said`` already,
    that ties no two joints linearly; and how many tendons the ties say all of."""
    ties, notes, tendons = list[Tie](), list[str](), set[int]()
    for equality in sorted({*range(model.neq)} - said):
        first, second = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
        kind, terms = model.eq_type[equality], [float(value) for value in model.eq_data[equality][:5]]
        sums: dict[int, float] | None = None
        if kind == mujoco.mjtEq.mjEQ_JOINT and not any(terms[2:]):
            sums = {first: 1.0} | ({second: -terms[1]} if second >= 0 and terms[1] else {})
        elif kind == mujoco.mjtEq.mjEQ_TENDON and not any(terms[2:]):
            sums = combined(mujoco, model, ((first, 1.0), (second, -terms[1])))
        if sums is None or not 1 <= len(sums) <= 2 or not model.eq_active0[equality]:
            notes.append(left_out(mujoco, model, equality))
            continue
        if kind == mujoco.mjtEq.mjEQ_TENDON:
            tendons |= {first, second} - {-1}
        (joint, own), *others = sums.items()
        leader, other = others[0] if others else (joint, 0.0)
        ties.append(Tie(name(joint), name(leader), -other / own, terms[0] / own))
    return ties, notes, len(tendons)


def left_out(mujoco: Any, model: Any, equality: int) -> str:
    """The note on an equality that no URDF can say: its kind, what it ties, and why."""
    tag = mujoco.mjtEq(int(model.eq_type[equality])).name.removeprefix("mjEQ_").lower()
    ids = (int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality]))
    names = [str(mujoco.mj_id2name(model, int(model.eq_objtype[equality]), item) or "the world") for item in ids]
    why = "closes a loop" if tag in ("connect", "weld") else "is not linear, or of several joints"
    why = why if model.eq_active0[equality] else "is not active"
    return f"the {tag} of '{names[0]}' and '{names[1]}' {why}, which a URDF cannot say: it is left out"


def combined(mujoco: Any, model: Any, parts: Sequence[tuple[int, float]]) -> dict[int, float] | None:
    """Joint → its factor in the sum of these tendons' lengths, each times a number; None where one goes over more than
    joints. A tendon of -1 is none."""
    found: dict[int, float] = {}
    for tendon, times in parts:
        start = model.tendon_adr[tendon] if tendon >= 0 else 0
        for wrap in range(start, start + (model.tendon_num[tendon] if tendon >= 0 else 0)):
            if model.wrap_type[wrap] != mujoco.mjtWrap.mjWRAP_JOINT:
                return None
            joint = int(model.wrap_objid[wrap])
            found[joint] = found.get(joint, 0.0) + times * float(model.wrap_prm[wrap])
    return {joint: factor for joint, factor in found.items() if factor}


def tie(robot: Element, ties: Sequence[Tie]) -> Iterator[str]:
    """Let joints follow as they are tied; a note on each that is held instead, or tied in a circle.

    An equality has no side that moves the other: of joints that are tied together all follow one that collides, for a
    hand to move it, and of these the one that moves furthest: a knob leads the light beside it."""
    joints = {str(item.get("name")): item for item in robot.findall("joint")}
    ties = [item for item in ties if {item.joint, item.leader} <= joints.keys()]  # those of a free body are none
    for held in [item for item in ties if item.ratio == 0.0]:
        if held.offset:
            yield f"joint '{held.joint}', which an equality holds at {held.offset:g}, is left to move"
        else:
            joints[held.joint].set("type", "fixed")
            yield f"joint '{held.joint}', which an equality holds, is fixed"
    waiting = [item for item in ties if item.ratio != 0.0]
    while waiting:
        group: dict[str, tuple[float, float]] = {waiting[0].leader: (1.0, 0.0)}
        stated = {item.leader for item in waiting}
        while (found := next((item for item in waiting if {item.joint, item.leader} & group.keys()), None)) is not None:
            waiting.remove(found)
            if {found.joint, found.leader} <= group.keys():
                yield f"'{found.joint}' is tied to '{found.leader}' in a circle; one tie of it is left out"
            elif found.leader in group:
                ratio, offset = group[found.leader]
                group[found.joint] = found.ratio * ratio, found.ratio * offset + found.offset
            else:
                ratio, offset = group[found.joint]
                group[found.leader] = ratio / found.ratio, (offset - found.offset) / found.ratio
        furthest = max(math.log(abs(ratio)) for ratio, _ in group.values())

        def rank(name: str, group: dict[str, tuple[float, float]] = group, most: float = furthest,
                 stated: set[str] = stated) -> tuple[bool, bool, bool]:  # fmt: skip
            return collides(robot, joints[name]), math.log(abs(group[name][0])) > most - SAME, name in stated

        leader = max(group, key=rank)
        scale, shift = group[leader]
        for name, (ratio, offset) in group.items():
            if name != leader:
                add_child(joints[name], "mimic", joint=leader, multiplier=short_numbers([ratio / scale]),
                    offset=short_numbers([offset - ratio * shift / scale]))  # fmt: skip


def collides(robot: Element, joint: Element) -> bool:
    """Whether what a joint moves has a collision shape."""
    below = {str(end.get("link")) for end in joint.findall("child")}
    while further := {
        str(end.get("link")) for item in robot.findall("joint") for end in item.findall("child")
        if {str(start.get("link")) for start in item.findall("parent")} & below
    } - below:  # fmt: skip
        below |= further
    return any(link.find("collision") is not None for link in robot.findall("link") if link.get("name") in below)


def driven_joints(mujoco: Any, model: Any, name: Callable[[int], str]) -> frozenset[str]:
    """The joints of a compiled model that actuators move, by ``name``, be it through tendons, as muscles do."""
    of_joints = [int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)]
    found = set[int]()
    for kind, number in zip(model.actuator_trntype.tolist(), model.actuator_trnid[:, 0].tolist(), strict=True):
        if kind in of_joints:
            found.add(number)
        elif kind == int(mujoco.mjtTrn.mjTRN_TENDON):
            found |= tendon_joints(mujoco, model, number)
    return frozenset(map(name, found))


def led_by_mocap(mujoco: Any, model: Any) -> frozenset[int]:
    """The bodies in the world of which a part is welded or pinned to a mocap body: a program leads them, as it leads a
    robot's hand. None where nothing else in the file has joints."""
    ties = (int(mujoco.mjtEq.mjEQ_WELD), int(mujoco.mjtEq.mjEQ_CONNECT))
    found = set[int]()
    for equality in range(model.neq):
        of_bodies = int(model.eq_objtype[equality]) == int(mujoco.mjtObj.mjOBJ_BODY)
        if model.eq_type[equality] in ties and of_bodies and model.eq_active0[equality]:
            pair = [int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])]
            for body, other in (pair, pair[::-1]):
                found |= {int(model.body_rootid[other])} if model.body_mocapid[body] >= 0 and other else set()
    jointed = model.jnt_bodyid[model.jnt_type != int(mujoco.mjtJoint.mjJNT_FREE)]
    return frozenset(found if {*model.body_rootid[jointed].tolist()} - found else ())


def tendon_joints(mujoco: Any, model: Any, tendon: int) -> Set[int]:
    """The joints over which a tendon goes: those it names, and those that move a part of the bodies that it is tied
    to."""
    wraps = range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
    named = {int(model.wrap_objid[i]) for i in wraps if model.wrap_type[i] == mujoco.mjtWrap.mjWRAP_JOINT}
    tied = [int(model.wrap_objid[i]) for i in wraps if model.wrap_type[i] == mujoco.mjtWrap.mjWRAP_SITE]
    above = [joints_above(model, int(model.site_bodyid[site])) for site in tied]
    return named.union(*above) - frozenset.intersection(*above) if above else named


def joints_above(model: Any, body: int) -> frozenset[int]:
    """The joints that move a body in the world."""
    found = set[int]()
    while body > 0:
        found |= set(range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body]))
        body = int(model.body_parentid[body])
    return frozenset(found)
