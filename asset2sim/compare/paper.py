"""The paper's own figures (arXiv 2605.19136), to stand beside ours."""

from dataclasses import dataclass

from schemas.vocabulary import Method


@dataclass(frozen=True)
class Stated:
    """A figure as the paper states it, with its standard deviation where there is one."""

    value: float
    spread: float | None = None


NINE = "paper9"
"""The subset of Table 1's nine objects."""
SKIPPED = ("Stapler", "Toilet")
"""Categories that the paper's heading of penetration singles out."""

TABLE_1: dict[Method, dict[str, Stated]] = {
    Method.REFERENCE: {
        "penetration_nonzero": Stated(15.95, 22.55), "drift": Stated(88.9), "oscillation": Stated(100.0),
    },
    Method.IVW: {
        "penetration_nonzero": Stated(13.62, 19.26), "drift": Stated(77.8), "oscillation": Stated(77.8),
        "scale": Stated(38.35, 31.35), "joint": Stated(0.42, 0.41), "alignment": Stated(82.22),
    },
    Method.DIRECT: {
        "penetration_nonzero": Stated(61.77, 70.76), "drift": Stated(66.7), "oscillation": Stated(77.8),
        "scale": Stated(35.02, 37.58), "joint": Stated(0.50, 0.48), "alignment": Stated(86.11),
    },
    Method.ASSET2SIM: {
        "penetration_nonzero": Stated(12.83, 18.14), "drift": Stated(100.0), "oscillation": Stated(100.0),
        "scale": Stated(32.73, 16.51), "joint": Stated(0.40, 0.48), "alignment": Stated(97.22),
    },
    Method.AGENT: {
        "penetration_nonzero": Stated(723.4), "drift": Stated(88.9), "oscillation": Stated(88.9),
        "scale": Stated(325.76), "joint": Stated(0.48), "alignment": Stated(52.78),
    },
    Method.NO_SEMANTICS: {
        "penetration_nonzero": Stated(16.01), "drift": Stated(100.0), "oscillation": Stated(100.0),
        "scale": Stated(44.48), "joint": Stated(0.53), "alignment": Stated(88.89),
    },
}  # fmt: skip
"""Stability and semantics over the nine objects (Table 1, and its ablations), by key of figure: mm, %, rad."""

TABLE_6: dict[Method, dict[str, Stated]] = {
    Method.IVW: {
        "penetration_nonzero": Stated(18.03, 57.19), "drift": Stated(93.75), "oscillation": Stated(98.75),
    },
    Method.DIRECT: {"penetration_nonzero": Stated(19.86), "drift": Stated(77.5), "oscillation": Stated(82.5)},
    Method.ASSET2SIM: {
        "penetration_nonzero": Stated(11.65, 37.85), "drift": Stated(97.5), "oscillation": Stated(98.75),
        "success": Stated(96.0),
    },
}  # fmt: skip
"""The large set: 80 of 93 assets that all methods finished; ``success`` is over all 93."""

TABLE_7: dict[Method, dict[str, Stated]] = {
    Method.IVW: {"calls": Stated(25.0)},
    Method.DIRECT: {"calls": Stated(1.0)},
    Method.ASSET2SIM: {"calls": Stated(2.26, 3.72)},
}
"""Queries an asset."""


def stated(subset: str | None, method: Method, key: str) -> Stated | None:
    """The paper's figure for a method: of the nine objects where those were run, else of the large set; None if it
    states none."""
    source = TABLE_1 if subset == NINE and key != "success" else TABLE_6
    return (source.get(method) or {}).get(key) or (TABLE_7.get(method) or {}).get(key)
