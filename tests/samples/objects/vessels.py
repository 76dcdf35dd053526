"""Round things with walls: a trash can with a pedal, a bucket, and a toilet."""

import math

from tests.samples.blueprint import GAP, Blueprint, Finish, Link, hinge, pieces
from tests.samples.shapes import block, disc, loft, ring, shell, tube

STEEL = Finish((0.68, 0.7, 0.72))
BLACK = Finish((0.12, 0.12, 0.13))
YELLOW = Finish((0.92, 0.74, 0.14))
WOODEN = Finish((0.6, 0.42, 0.24))
PORCELAIN = Finish((0.94, 0.94, 0.92))
CREAM = Finish((0.86, 0.84, 0.76))
CHROME = Finish((0.78, 0.8, 0.82))


def trash_can() -> Blueprint:
    """A pedal bin: a conical wall, a domed lid hinged at the back and a foot pad at the front."""
    brackets = [block((x, 0.02, 0.38), (x + 0.03, 0.1, 0.54)) for x in (-0.15, 0.12)]
    body = (
        *pieces("wall", STEEL, ring("y", (0.0, 0.08, 0.0), (0.38, 0.46), (0.42, 0.5), 1.02, 16)),
        *pieces("bottom", BLACK, disc("y", (0.0, 0.0, 0.0), 0.42, 0.08)),
        *pieces("bracket", BLACK, [*brackets, block((-0.1, 0.95, -0.59), (0.1, 1.08, -0.49))]),
    )
    rim = 1.1 + GAP
    lid = (
        *pieces("cover", STEEL, disc("y", (0.0, rim, 0.0), 0.51, 0.04)),
        *pieces("cover", STEEL, disc("y", (0.0, rim + 0.04, 0.0), (0.49, 0.3), 0.08)),
        *pieces("tab", BLACK, block((-0.08, rim, -0.56), (0.08, rim + 0.04, -0.48))),
    )
    pad = (
        *pieces("pad", BLACK, block((-0.09, 0.05, 0.52), (0.09, 0.08, 0.66))),
        *pieces("arm", BLACK, block((-0.05, 0.05, 0.45), (0.05, 0.08, 0.52))),
    )
    parts = (
        Link("pad", "foot_pad", pad, hinge("body", (0.0, 0.065, 0.48), (1.0, 0.0, 0.0), 0.2)),
        Link("lid", "lid", lid, hinge("body", (0.0, 1.1 + GAP / 2, -0.57), (-1.0, 0.0, 0.0), 1.4)),
        Link("body", "trashcan_body", body),
    )
    prompt = "A small personal trash can with its lid slightly open. "
    prompt += "The hinge has low damping and holds its position."
    return Blueprint("trashcan_pedal", "TrashCan", prompt, parts)


def bucket() -> Blueprint:
    """A bucket whose bow-shaped handle clears the rim on both sides."""
    ears = [block((x, 0.9, -0.05), (x + 0.02, 1.02, 0.05)) for x in (-0.505, 0.485)]
    body = (
        *pieces("wall", YELLOW, ring("y", (0.0, 0.04, 0.0), (0.34, 0.45), (0.37, 0.48), 0.96, 16)),
        *pieces("bottom", YELLOW, disc("y", (0.0, 0.0, 0.0), 0.37, 0.04)),
        *pieces("ear", STEEL, ears),
    )
    turns = [math.pi * (1.0 - i / 12) for i in range(13)]
    bow = tube([(0.555 * math.cos(t), 0.96 + 0.6 * math.sin(t), 0.0) for t in turns], (0.0, 0.0, 1.0), 0.02)
    handle = (*pieces("handle", STEEL, bow), *pieces("grip", WOODEN, disc("x", (-0.12, 1.56, 0.0), 0.035, 0.24, 12)))
    joint = hinge("body", (0.0, 0.96, 0.0), (-1.0, 0.0, 0.0), 1.57, lower=-1.57)
    prompt = "A small bucket with its handle upright, super low friction so that it swings freely."
    parts = (Link("handle", "handle", handle, joint), Link("body", "bucket_body", body))
    return Blueprint("bucket_yellow", "Bucket", prompt, parts)


def toilet() -> Blueprint:
    """A toilet with seat and lid about one pin, and a flush lever on the side of the tank."""
    foot = [(-0.2, 0.0, -0.35), (0.2, 0.0, -0.35), (0.2, 0.0, 0.45), (-0.2, 0.0, 0.45)]
    neck = [(-0.18, 0.34, -0.2), (0.18, 0.34, -0.2), (0.18, 0.34, 0.4), (-0.18, 0.34, 0.4)]
    body = (
        *pieces("foot", PORCELAIN, loft(foot, neck)),
        *pieces("bowl", PORCELAIN, ring("y", (0.0, 0.34, 0.18), (0.2, 0.32), (0.27, 0.42), 0.36, 16, stretch=1.15)),
        *pieces("bowl_floor", PORCELAIN, disc("y", (0.0, 0.34, 0.18), 0.2, 0.04, 16, stretch=1.15)),
        *pieces("bridge", PORCELAIN, block((-0.26, 0.45, -0.85), (0.26, 0.68, -0.31))),
        *pieces("tank", PORCELAIN, shell((-0.46, 0.68, -0.92), (0.46, 1.24, -0.55), 0.04, without="none")),
        *pieces("tank_lid", PORCELAIN, block((-0.48, 1.24, -0.94), (0.48, 1.29, -0.53))),
    )
    pin = (0.0, 0.74, -0.37)
    seat_y = 0.7 + GAP
    seat = (
        *pieces("seat", CREAM, ring("y", (0.0, seat_y, 0.18), 0.29, 0.43, 0.04, 16, stretch=1.15)),
        *pieces("seat_tab", CREAM, block((-0.16, seat_y, -0.38), (0.16, seat_y + 0.04, -0.28))),
    )
    lid_y = seat_y + 0.04 + GAP
    lid = (
        *pieces("lid", PORCELAIN, disc("y", (0.0, lid_y, 0.18), (0.43, 0.42), 0.04, 24, stretch=1.15)),
        *pieces("lid_tab", PORCELAIN, block((-0.16, lid_y, -0.38), (0.16, lid_y + 0.04, -0.28))),
    )
    lever = pieces("lever", CHROME, block((-0.51, 1.05, -0.78), (-0.46 - GAP, 1.09, -0.56)))
    parts = (
        Link("lever", "lever", lever, hinge("body", (-0.49, 1.07, -0.75), (1.0, 0.0, 0.0), 0.52)),
        Link("lid", "lid", lid, hinge("body", pin, (-1.0, 0.0, 0.0), 1.6)),
        Link("seat", "seat", seat, hinge("body", pin, (-1.0, 0.0, 0.0), 1.55)),
        Link("body", "toilet_body", body, kind="static"),
    )
    prompt = "I want a very small toilet for a baby, with its lid fully open and the seat down."
    return Blueprint("toilet_white", "Toilet", prompt, parts)
