"""Luggage, which PartNet-Mobility files under Suitcase: a handbag and a business suitcase."""

import math

from tests.samples.blueprint import GAP, Blueprint, Finish, Link, hinge, pieces
from tests.samples.shapes import Mesh, Point, block, loft, shell, tube

LEATHER = Finish((0.55, 0.2, 0.16))
BLACK = Finish((0.1, 0.1, 0.11))
STEEL = Finish((0.74, 0.75, 0.77))
CANVAS = Finish((0.3, 0.36, 0.48), texture="canvas")


def handbag() -> Blueprint:
    """A bag with sloping sides, closed on top, and one stiff handle that tips to either side."""
    # Half width and half depth of the outline at the foot and at the head.
    (foot_x, foot_z), (head_x, head_z) = (0.6, 0.22), (0.5, 0.09)
    wall, height = 0.04, 0.8

    def side(sign: float) -> Mesh:
        fz, hz = foot_z - wall, head_z - wall
        outline = [(foot_x, 0.03, -fz), (foot_x, 0.03, fz), (head_x, height, hz), (head_x, height, -hz)]
        return loft([(sign * x, y, z) for x, y, z in outline], [(sign * (x - wall), y, z) for x, y, z in outline])

    def face(sign: float) -> Mesh:
        outline = [(-foot_x, 0.03, foot_z), (foot_x, 0.03, foot_z), (head_x, height, head_z), (-head_x, height, head_z)]
        return loft([(x, y, sign * z) for x, y, z in outline], [(x, y, sign * (z - wall)) for x, y, z in outline])

    inner_x, inner_z = foot_x - wall - 0.01, foot_z - wall - 0.01
    posts = [block((x, height, -0.03), (x + 0.04, height + 0.11, 0.03)) for x in (-0.34, 0.3)]
    body = (
        *pieces("bag", LEATHER, [face(1.0), face(-1.0), side(1.0), side(-1.0)]),
        *pieces("bottom", BLACK, block((-inner_x, 0.0, -inner_z), (inner_x, 0.03, inner_z))),
        *pieces("zip", BLACK, block((-0.45, height - 0.04, -0.045), (0.45, height, 0.045))),
        *pieces("ring", STEEL, posts),
        *pieces("buckle", STEEL, block((-0.08, 0.42, 0.15), (0.08, 0.52, 0.19))),
    )
    pivot = (0.0, height + 0.075, 0.0)
    grip = pieces("handle", LEATHER, tube(_arch(0.25, pivot, 0.34), (0.0, 0.0, 1.0), 0.024))
    joint = hinge("body", pivot, (-1.0, 0.0, 0.0), math.pi / 2, lower=-math.pi / 2)
    prompt = "I want a small handbag with the handle moving freely, resting sideways."
    parts = (Link("handle", "rotation_handle", grip, joint), Link("body", "suitcase_body", body))
    return Blueprint("suitcase_handbag", "Suitcase", prompt, parts)


def business_suitcase() -> Blueprint:
    """A case lying on its back: a lid that is the other half of the shell, and a handle on the front."""
    body = (
        *pieces("frame", CANVAS, shell((-0.7, 0.0, -0.5), (0.7, 0.22, 0.5), 0.03, without="top")),
        *pieces("bracket", STEEL, [block((x, 0.07, 0.5), (x + 0.04, 0.15, 0.6)) for x in (-0.26, 0.22)]),
    )
    rim = 0.22 + GAP
    lid = (
        *pieces("cover", CANVAS, shell((-0.7, rim, -0.5), (0.7, rim + 0.18, 0.5), 0.03, without="bottom")),
        *pieces("latch", STEEL, [block((x, rim + 0.01, 0.5), (x + 0.12, rim + 0.08, 0.52)) for x in (-0.55, 0.43)]),
    )
    pivot = (0.0, 0.11, 0.57)
    path = [(x, 0.11, 0.57 + forward) for x, forward in ((-0.17, 0.0), (-0.17, 0.1), (-0.12, 0.15))]
    path += [(-x, y, z) for x, y, z in reversed(path)]
    grip = pieces("handle", BLACK, tube(path, (0.0, 1.0, 0.0), 0.024))
    parts = (
        Link("handle", "rotation_handle", grip, hinge("body", pivot, (-1.0, 0.0, 0.0), 1.2, lower=-0.3)),
        Link("lid", "lid", lid, hinge("body", (0.0, 0.22 + GAP / 2, -0.53), (-1.0, 0.0, 0.0), 2.0, authored=0.9)),
        Link("body", "suitcase_body", body),
    )
    prompt = "I want a small business suitcase with its lid slightly open and a low damping hinge."
    return Blueprint("suitcase_business", "Suitcase", prompt, parts)


def _arch(half: float, pivot: Point, rise: float) -> list[Point]:
    # Two straight legs and a half ellipse over them, in the plane of x and y.
    legs = rise * 0.35
    turns = [math.pi * (1.0 - i / 8) for i in range(9)]
    bow = [(half * math.cos(t), pivot[1] + legs + (rise - legs) * math.sin(t), pivot[2]) for t in turns]
    return [(-half, pivot[1], pivot[2]), *bow, (half, pivot[1], pivot[2])]
