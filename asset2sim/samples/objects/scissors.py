"""Scissors: two legs that lie one over the other and turn about one rivet."""

from asset2sim.samples.blueprint import Blueprint, Paint, Part, Piece, hinge, pieces
from asset2sim.samples.shapes import Mesh, disc, loft, ring

STEEL = Paint((0.75, 0.76, 0.78))
GRIP = Paint((0.9, 0.42, 0.08))
THICK = 0.03
BLADE = [(-1.0, 0.02), (-0.25, -0.04), (0.1, -0.05), (0.1, 0.06), (-0.25, 0.09)]
SHANK = [(0.1, -0.05), (0.42, -0.17), (0.42, -0.08), (0.1, 0.06)]


def scissors() -> Blueprint:
    """A pair lying flat, authored 0.6 rad open, its handles as thick as both blades together."""
    upper = _leg(0.056, 1.0)
    rivet = pieces("rivet", STEEL, disc("y", (0.0, 0.056 + THICK, 0.0), 0.04, 0.015, 12))
    joint = hinge("fixed", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.9, authored=0.6)
    parts = (Part("moving", "leg", upper + rivet, joint), Part("fixed", "leg", _leg(0.0, -1.0)))
    prompt = "A wide open pair of scissors, low damping for an easy opening and closing motion."
    return Blueprint("scissors_paper", "Scissors", prompt, parts)


def _leg(low: float, sign: float) -> tuple[Piece, ...]:
    def plate(outline: list[tuple[float, float]]) -> Mesh:
        flat = [(x, sign * z) for x, z in outline]
        return loft([(x, low, z) for x, z in flat], [(x, low + THICK, z) for x, z in flat])

    # The bow is egg-shaped: stretched along z less than along x.
    bow = ring("y", (0.62, 0.0, sign * -0.19), 0.18, 0.24, 0.086, 14, stretch=0.7)
    return (
        *pieces("blade", STEEL, plate(BLADE)),
        *pieces("shank", STEEL, plate(SHANK)),
        *pieces("handle", GRIP, bow),
    )
