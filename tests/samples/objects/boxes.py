"""Boxes: a wooden one with a flat lid, and a chest whose lid is an arch."""

import math

from tests.samples.blueprint import GAP, Blueprint, Finish, Link, NamedMesh, hinge, pieces
from tests.samples.shapes import Mesh, block, disc, loft, ring, shell

WOOD = Finish((0.68, 0.48, 0.28), texture="wood")
DARK_WOOD = Finish((0.36, 0.2, 0.1))
FELT = Finish((0.5, 0.1, 0.14))
BRASS = Finish((0.8, 0.66, 0.3))


def box_body() -> Link:
    """The open wooden box of ``wooden_box``: five panels, and the knuckles of its hinge."""
    knuckles = [disc("x", (x, 0.79, -0.55), 0.024, 0.16, 12) for x in (-0.58, 0.42)]
    straps = [block((x, 0.6, -0.53), (x + 0.16, 0.74, -0.5)) for x in (-0.58, 0.42)]
    feet = [block((x, -0.04, z), (x + 0.12, 0.0, z + 0.12)) for x in (-0.74, 0.62) for z in (-0.49, 0.37)]
    parts = (
        *pieces("frame", WOOD, shell((-0.75, 0.0, -0.5), (0.75, 0.75, 0.5), 0.05, without="top")),
        *pieces("hinge", BRASS, [*knuckles, *straps]),
        *pieces("foot", DARK_WOOD, feet),
    )
    return Link("body", "box_body", parts)


def box_lid(
    extra: tuple[NamedMesh, ...] = (), *, lower: float = 0.0, upper: float = 2.1, authored: float = 0.0
) -> Link:
    """The flat lid of ``wooden_box``, with ``extra`` pieces on it."""
    bottom = 0.75 + GAP
    parts = (
        *pieces("cover", WOOD, block((-0.77, bottom, -0.5), (0.77, bottom + 0.05, 0.53))),
        *pieces("latch", BRASS, block((-0.09, 0.6, 0.53), (0.09, bottom + 0.05, 0.56))),
    )
    joint = hinge("body", (0.0, 0.79, -0.55), (-1.0, 0.0, 0.0), upper, lower=lower, authored=authored)
    return Link("lid", "rotation_lid", parts + extra, joint)


def wooden_box() -> Blueprint:
    """A wooden box with a flat lid, authored half a radian open."""
    prompt = "A small box with its lid slightly open. Low damping for a smooth hinge."
    return Blueprint("box_wooden", "Box", prompt, (box_lid(authored=0.5), box_body()))


def treasure_chest() -> Blueprint:
    """A chest with a barrel-shaped lid that is hollow inside."""
    width, depth, top = 0.7, 0.44, 0.6
    rim = top + GAP
    body = (
        *pieces("frame", DARK_WOOD, shell((-width, 0.0, -depth), (width, top, depth), 0.06, without="top")),
        *pieces("lining", FELT, block((-width + 0.06, 0.06, -depth + 0.06), (width - 0.06, 0.08, depth - 0.06))),
        *pieces("band", BRASS, [block((x, 0.0, depth), (x + 0.1, top, depth + 0.02)) for x in (-0.5, 0.4)]),
    )
    lid = (
        *pieces("cover", DARK_WOOD, _vault(-width, width, rim, depth - 0.06, depth)),
        *pieces("cover_end", DARK_WOOD, [_gable(x, x + 0.06, rim, depth - 0.06) for x in (-width, width - 0.06)]),
        *pieces("band", BRASS, [m for x in (-0.5, 0.4) for m in _vault(x, x + 0.1, rim, depth, depth + 0.02)]),
        *pieces("clasp", BRASS, block((-0.08, top - 0.16, depth + 0.03), (0.08, rim + 0.06, depth + 0.06))),
    )
    joint = hinge("body", (0.0, rim - GAP / 2, -depth - 0.04), (-1.0, 0.0, 0.0), 1.9)
    prompt = "A very small treasure chest for jewellery, its lid halfway open and staying where it is placed."
    parts = (Link("lid", "rotation_lid", lid, joint), Link("body", "box_body", body))
    return Blueprint("box_chest", "Box", prompt, parts)


def _vault(x0: float, x1: float, base: float, inner: float, outer: float) -> list[Mesh]:
    # Half a tube around x: y is its first radial direction, so it spans from -90 to 90 degrees.
    return ring("x", (x0, base, 0.0), inner, outer, x1 - x0, 8, arc=(-math.pi / 2, math.pi / 2))


def _gable(x0: float, x1: float, base: float, radius: float) -> Mesh:
    turns = [math.pi * i / 8 for i in range(9)]
    outline = [(base + radius * math.sin(t), radius * math.cos(t)) for t in turns]
    return loft([(x0, y, z) for y, z in outline], [(x1, y, z) for y, z in outline])
