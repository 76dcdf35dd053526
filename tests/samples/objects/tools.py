"""Scissors and a stapler."""

from tests.samples.blueprint import Blueprint, Finish, Link, NamedMesh, hinge, pieces
from tests.samples.shapes import Mesh, block, disc, loft, ring

RED = Finish((0.72, 0.1, 0.12))
STEEL = Finish((0.72, 0.73, 0.75))
BLACK = Finish((0.12, 0.12, 0.13))
PIN = (0.0, 0.255, -0.75)


def stapler() -> Blueprint:
    """A desk stapler, authored slightly open. The magazine swings out below the lid for loading, as real ones do."""
    cheeks = [block((x, 0.06, -0.88), (x + 0.04, 0.36, -0.62)) for x in (-0.17, 0.13)]
    base = (
        *pieces("plate", BLACK, block((-0.17, 0.0, -0.9), (0.17, 0.06, 0.9))),
        *pieces("anvil", STEEL, block((-0.1, 0.06, 0.62), (0.1, 0.08, 0.82))),
        *pieces("cheek", BLACK, cheeks),
        *pieces("pin", STEEL, [disc("x", (x, PIN[1], PIN[2]), 0.045, 0.02, 12) for x in (-0.19, 0.17)]),
    )
    nose = [(-0.15, 0.2, 0.87), (0.15, 0.2, 0.87), (0.15, 0.36, 0.87), (-0.15, 0.36, 0.87)]
    tip = [(-0.13, 0.2, 0.93), (0.13, 0.2, 0.93), (0.12, 0.33, 0.91), (-0.12, 0.33, 0.91)]
    lid = (
        *pieces("cover", RED, block((-0.15, 0.31, -0.5), (0.15, 0.36, 0.87))),
        *pieces("cover", RED, [block((x, 0.2, -0.5), (x + 0.025, 0.31, 0.87)) for x in (-0.15, 0.125)]),
        *pieces("nose", RED, loft(nose, tip)),
        *pieces("neck", RED, [block((x, 0.2, -0.82), (x + 0.027, 0.35, -0.5)) for x in (-0.104, 0.077)]),
    )
    magazine = (
        *pieces("rail", STEEL, block((-0.09, 0.11, -0.47), (0.09, 0.13, 0.84))),
        *pieces("rail", STEEL, [block((x, 0.13, -0.47), (x + 0.02, 0.25, 0.84)) for x in (-0.09, 0.07)]),
        *pieces("stop", STEEL, block((-0.07, 0.13, 0.8), (0.07, 0.25, 0.84))),
        *pieces("staples", STEEL, block((-0.06, 0.13, -0.1), (0.06, 0.22, 0.8))),
        *pieces("tongue", STEEL, block((-0.05, 0.15, -0.8), (0.05, 0.28, -0.44))),
    )
    parts = (
        Link("body", "stapler_body", magazine, hinge("lid", PIN, (1.0, 0.0, 0.0), 2.6, authored=0.06)),
        Link("lid", "lid", lid, hinge("base", PIN, (-1.0, 0.0, 0.0), 1.9, authored=0.16)),
        Link("base", "stapler_base", base),
    )
    prompt = "I want a slightly open stapler, with spring behaviour in its joint for pressing."
    return Blueprint("stapler_desk", "Stapler", prompt, parts)


BLADE_STEEL = Finish((0.75, 0.76, 0.78))
GRIP = Finish((0.9, 0.42, 0.08))
THICK = 0.03
BLADE = [(-1.0, 0.02), (-0.25, -0.04), (0.1, -0.05), (0.1, 0.06), (-0.25, 0.09)]
SHANK = [(0.1, -0.05), (0.42, -0.17), (0.42, -0.08), (0.1, 0.06)]


def scissors() -> Blueprint:
    """A pair lying flat, authored 0.6 rad open, its handles as thick as both blades together."""
    upper = _leg(0.056, 1.0)
    rivet = pieces("rivet", BLADE_STEEL, disc("y", (0.0, 0.056 + THICK, 0.0), 0.04, 0.015, 12))
    joint = hinge("fixed", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.9, authored=0.6)
    parts = (Link("moving", "leg", upper + rivet, joint), Link("fixed", "leg", _leg(0.0, -1.0)))
    prompt = "A wide open pair of scissors, low damping for an easy opening and closing motion."
    return Blueprint("scissors_paper", "Scissors", prompt, parts)


def _leg(low: float, sign: float) -> tuple[NamedMesh, ...]:
    def plate(outline: list[tuple[float, float]]) -> Mesh:
        flat = [(x, sign * z) for x, z in outline]
        return loft([(x, low, z) for x, z in flat], [(x, low + THICK, z) for x, z in flat])

    # The bow is egg-shaped: stretched along z less than along x.
    bow = ring("y", (0.62, 0.0, sign * -0.19), 0.18, 0.24, 0.086, 14, stretch=0.7)
    return (
        *pieces("blade", BLADE_STEEL, plate(BLADE)),
        *pieces("shank", BLADE_STEEL, plate(SHANK)),
        *pieces("handle", GRIP, bow),
    )
