"""Links that an MJCF lets pass through each other: by the bits of its geoms, its exclusions, or having no contacts."""

from collections.abc import Collection, Mapping
from itertools import combinations
from typing import Any

NO_BITS = (0, 0)


def masks_of(model: Any, links: Mapping[int, str], ground: Collection[int]) -> dict[str, tuple[int, int]]:
    """Link → the bits of all its shapes, contype and conaffinity; both 0 where it collides with nothing. ``links``
    names the bodies, ``ground`` the geoms that are no part of an object."""
    found = dict[str, tuple[int, int]]()
    for geom in range(model.ngeom):
        if geom not in ground:
            name = links[int(model.geom_bodyid[geom])]
            kind, reach = found.get(name, NO_BITS)
            found[name] = kind | int(model.geom_contype[geom]), reach | int(model.geom_conaffinity[geom])
    return found


def let_pass(
    mujoco: Any, model: Any, links: Mapping[int, str], masks: Mapping[str, tuple[int, int]]
) -> list[tuple[str, str]]:
    """Pairs of links that the file lets pass through each other, of which engines let a link pass its parent alone: all
    where it switches contacts off; those that it excludes; those whose bits do not meet, if either has any. Of two
    without bits nothing is said: they have no collision shapes, and pass where one is fixed to what the other moves in.
    """
    off = mujoco.mjtDisableBit
    contactless = bool(model.opt.disableflags & (int(off.mjDSBL_CONTACT) | int(off.mjDSBL_CONSTRAINT)))
    excluded = {divmod(int(pair), 1 << 16) for pair in model.exclude_signature}
    found = []
    for first, second in combinations([body for body, name in links.items() if name in masks], 2):
        own, other = masks[links[first]], masks[links[second]]
        apart = not (own[0] & other[1] or other[0] & own[1])
        if own == other == NO_BITS:
            apart = in_one_frame(model, first, second)
        stated = contactless or {(first, second), (second, first)} & excluded
        if (stated or apart) and not are_adjoining(model, first, second):
            found.append((links[first], links[second]))
    return found


def are_adjoining(model: Any, first: int, second: int) -> bool:
    """Whether one of two bodies is the other's parent, or both stand still in the world."""
    parents, welds = model.body_parentid, model.body_weldid
    return bool(parents[first] == second or parents[second] == first or not (welds[first] or welds[second]))


def in_one_frame(model: Any, first: int, second: int) -> bool:
    """Whether one of two bodies is fixed to what the other moves in."""
    welds, parents = model.body_weldid, model.body_parentid
    held = {body: int(welds[parents[welds[body]]]) if welds[body] else -1 for body in (first, second)}
    return bool(held[first] == welds[second] or held[second] == welds[first])
