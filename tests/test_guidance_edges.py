"""How large a cupboard is that is drawn without units: by its edges, its fronts, and whether it hangs."""

import math
from itertools import pairwise
from pathlib import Path

import pytest

from asset2sim.guidance import tables
from asset2sim.guidance.edges import ON_WALL, fitted_edges, fitted_kind
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.models.object_facts import rounded_object_info
from asset2sim.models.prior.answer import prior_overlay
from schemas.overlay import Overlay
from schemas.support import Mount
from tasks.extract import with_wall_evidence
from tests.assets import read, written
from tests.prior_objects import Json, ask, hinged, sliding, thing
from tests.test_validation_hanging import FEET, cupboard

CUPBOARDS = {  # makers' depth, width, height, m; doors side by side, drawers one on another, height of plinth or legs
    "wardrobe": (0.50, 1.17, 1.90, 3, 0, 0.05),
    "linen cupboard": (0.42, 0.79, 1.66, 2, 0, 0.08),
    "half-height cupboard": (0.46, 0.70, 1.16, 2, 0, 0.04),
    "steel cupboard on legs": (0.40, 0.80, 1.19, 2, 0, 0.10),
    "narrow cupboard": (0.30, 0.50, 1.16, 1, 0, 0.10),
    "chest of six drawers": (0.48, 0.80, 1.23, 0, 6, 0.03),
    "nightstand": (0.48, 0.40, 0.55, 0, 2, 0.03),
    "office pedestal": (0.58, 0.42, 0.60, 0, 3, 0.05),
    "vanity": (0.45, 0.60, 0.83, 2, 0, 0.10),
    "television bench": (0.42, 1.80, 0.39, 3, 0, 0.03),
}
MOST_STEP = 0.25
"""Most change of size, as a logarithm, over a hundredth of an edge: where kinds met it was 0.8 and more."""


def furnished(depth: float, width: float, height: float, doors: int, drawers: int, base: float) -> Json:
    """A cupboard that faces −x, with its doors or drawers."""
    rise = (height - base) / max(drawers, 1)
    fronts = [
        hinged(f"d{i}", "rotation_door", (-depth / 2.0, width * ((i + 0.5) / doors - 0.5), (height + base) / 2.0))
        for i in range(doors)
    ]
    fronts += [sliding(f"s{i}", "drawer", (0.0, 0.0, base + (i + 0.5) * rise)) for i in range(drawers)]
    drawn = thing("StorageFurniture", *fronts) | {key: [depth, width, height] for key in ("size_closed_m", "size_m")}
    for item in drawn["links"]:
        item["box_m"] = [0.02, width / doors, height - base] if doors else [0.9 * depth, 0.95 * width, rise]
    drawn["links"][0] |= {"box_m": [depth, width, height], "center_m": [0.0, 0.0, height / 2.0]}
    return drawn


@pytest.mark.parametrize("name", CUPBOARDS)
def test_fronts_of_known_size_tell_how_large_a_cupboard_is(name: str) -> None:
    """By edges alone a nightstand was a base unit, a cupboard of 1.16 m a wall unit of 0.82 m that stood."""
    depth, width, height, doors, drawers, base = CUPBOARDS[name]
    times = 5.0 / height
    drawn = furnished(times * depth, times * width, times * height, doors, drawers, times * base)
    overlay = Overlay.model_validate(ask(drawn, ""))
    assert overlay.scale * times == pytest.approx(1.0, abs=0.2)
    assert overlay.support is not None and overlay.support.mount is None


@pytest.mark.parametrize("depth", [0.3, 0.4, 0.5, 0.6])
@pytest.mark.parametrize("width", [0.4, 0.8, 1.6])
def test_size_does_not_jump_where_kinds_that_stand_meet(depth: float, width: float) -> None:
    heights = [0.4 * 1.01**step for step in range(180)]
    fits = [
        fitted_edges((depth, width, height), "StorageFurniture", placed=("", "stands"), shown=True)
        for height in heights
    ]
    scales = [math.log(fit.scale) for fit in fits if fit is not None]
    assert len(scales) > 60
    assert max(abs(a - b) for a, b in pairwise(scales)) < MOST_STEP


def test_between_two_kinds_the_size_is_less_sure() -> None:
    sure, between = (
        fitted_edges(edges, "StorageFurniture", placed=("", "stands"), shown=True)
        for edges in ((0.58, 0.7, 0.87), (0.4, 0.8, 1.45))
    )
    assert sure is not None and between is not None and between.sigma > 1.5 * sure.sigma


@pytest.mark.parametrize(("below", "hangs"), [("", True), (FEET, False)])
def test_what_stands_has_no_size_of_a_kind_that_hangs(tmp_path: Path, below: str, hangs: bool) -> None:
    """A wall unit by its edges, on feet or without: what its shape shows says both how it is carried and its size."""
    item = with_wall_evidence(read(written(tmp_path, cupboard(below=below)), "StorageFurniture"), "StorageFurniture")
    info = rounded_object_info(item.features)
    overlay = prior_overlay(info, "")
    assert overlay.support is not None and (overlay.support.mount is Mount.WALL) is hangs
    hung, stood = (fitted_kind(info, "StorageFurniture", hangs=said) for said in (True, False))
    assert hung is not None and stood is not None
    assert hung.placed in ON_WALL and stood.placed not in ON_WALL
    assert hung.scale * 0.7 == pytest.approx(0.7, rel=0.2)


def test_a_lower_edge_over_legs_speaks_against_a_cabinet_that_hangs() -> None:
    """Flat as a medicine cabinet, with its door 0.1 of its height over its bottom."""
    hung, stood = (
        fitted_kind(ObjectInfo.from_json(furnished(0.14, 0.36, 0.52, 1, 0, base)), "StorageFurniture")
        for base in (0.0, 0.05)
    )
    assert hung is not None and hung.placed == "hangs"
    assert stood is None or stood.placed == ""


def test_parts_have_usual_sizes_of_categories_that_have_kinds() -> None:
    for category in ("StorageFurniture", "Table"):
        assert tables.part_sizes(category) and category in tables.proportions()
    assert tables.part_sizes("Wardrobe") == tables.part_sizes("StorageFurniture") and not tables.part_sizes("Bottle")


@pytest.mark.parametrize(("said", "height_m"), [("a desk", 0.74), ("a coffee table", 0.43)])
def test_words_choose_the_kind_where_edges_leave_it_open(said: str, height_m: float) -> None:
    edges = {key: [1.5, 3.0, 1.38] for key in ("size_closed_m", "size_m")}
    overlay = Overlay.model_validate(ask(thing("Table") | edges, said))
    assert overlay.scale * 1.38 == pytest.approx(height_m, abs=0.1)
    assert f"of a {said.removeprefix('a ')} " in " ".join(overlay.notes)


@pytest.mark.parametrize(
    ("edges", "category", "longest_m"), [((0.5, 0.6, 0.3), "", 0.44), ((0.66, 0.6, 1.1), "Copier", 1.1)]
)
def test_a_printer_as_tall_as_a_copier_with_its_paper_below_is_one(
    edges: tuple[float, float, float], category: str, longest_m: float
) -> None:
    fit = fitted_edges(edges, "Printer", shown=True)
    assert fit is not None and fit.category == category
    assert fit.scale * max(edges) == pytest.approx(longest_m, rel=0.15)
