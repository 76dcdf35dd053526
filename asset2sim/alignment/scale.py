"""The half of the alignment that is the size's."""

import math

from asset2sim.alignment.asked import AskedSize
from asset2sim.alignment.rubric import Rubric
from asset2sim.metrics.reference import Reference
from schemas.alignment import Score
from schemas.base import Vector3


def score_scale(
    scale: float, rest_size: Vector3, asked: AskedSize, reference: Reference | None, rubric: Rubric
) -> Score:
    """The credit for a uniform scale. ``rest_size`` holds the edges of the object's box at scale 1, m.

    Held against the size that the user states in numbers. Where there is none, the best credit counts of the scale that
    an expert states for the object; the household size of such an object times the word's factor; and, where no real
    size is asked for, the paper's size for handling on a table.
    """
    if asked.scale is not None:
        ratio = max(scale / asked.scale, asked.scale / scale)
        return _score(ratio, rubric.stated_ratio, rubric, f"the size that the user states (scale {asked.scale:.3g})")
    found: list[Score] = []
    if reference is not None and reference.states_scale:
        ratio = max(scale / reference.scale, reference.scale / scale)
        found.append(_score(ratio, rubric.expert_ratio, rubric, f"the expert's scale {reference.scale:.3g}"))
    size = scale * asked.dimension
    low, high = asked.household
    household = max(low / size, size / high) if size > 0.0 else 1.0
    word = f"a {asked.word} {asked.category}" if asked.word else f"a household {asked.category}"
    found.append(_score(household, 1.0, rubric, f"{word} ({low:.3g} to {high:.3g} m), at {size:.3g} m"))
    if asked.tabletop:
        edges = sorted(scale * edge for edge in rest_size)
        tabletop = _tabletop_ratio(edges[1], edges[2], rubric)
        at = f"the paper's tabletop size, at {edges[2]:.3g} m by {edges[1]:.3g} m"
        found.append(_score(tabletop, 1.0, rubric, at))
    return max(found, key=lambda item: item.value)


def _tabletop_ratio(section: float, length: float, rubric: Rubric) -> float:
    """How far outside the paper's tabletop rule an object is: the largest ratio to a bound that it breaks, at least
    1."""
    bounds = ((section, rubric.section_m), (length, rubric.length_m))
    return max(1.0, *(max(low / max(edge, 1e-9), edge / high) for edge, (low, high) in bounds))


def _score(ratio: float, met: float, rubric: Rubric, what: str) -> Score:
    if ratio <= met:
        return Score(value=1.0, reason=f"the scale meets {what}")
    left = math.log(rubric.none_ratio / ratio) / math.log(rubric.none_ratio / met)
    return Score(value=max(0.0, left), reason=f"the scale is {ratio:.3g} times off {what}")
