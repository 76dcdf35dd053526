"""Cupboards made as those of kitchens' walls are fixed to one, as a guess; those made to stand are not."""

from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.guidance.read import read_guidance
from asset2sim.guidance.supports import usual_support
from asset2sim.models.object_facts import rounded_object_info
from asset2sim.physics.arrays import Array
from asset2sim.validation.hanging import hangs_on_wall, lifts_up, swings_below
from asset2sim.validation.support import support_findings
from asset2sim.validation.validate import validate
from schemas.overlay import Overlay
from schemas.support import Mount, SupportKind, SupportProposal
from schemas.vocabulary import Severity, Source
from tests.assets import NO_VIEWS, joint, link, read, robot, shape, written


def cupboard(handle: float = 0.08, depth: float = 0.33, below: str = "", drawer: bool = False, end: float = 0.0) -> str:
    """A cupboard of 0.6 × 0.7 m with two doors, their handles ``handle`` over their lower edges, which are ``end`` over
    its bottom; ``below``: further shapes of the body."""
    walls = "".join(
        shape(size, xyz=xyz)
        for size, xyz in (
            (f"{depth} 0.02 0.7", "0 0.29 0.35"), (f"{depth} 0.02 0.7", "0 -0.29 0.35"),
            (f"{depth} 0.6 0.02", "0 0 0.01"), (f"{depth} 0.6 0.02", "0 0 0.69"),
            ("0.01 0.6 0.7", f"{-depth / 2} 0 0.35"),
        )
    )  # fmt: skip
    high, front = 0.7 - end, depth / 2.0
    parts = [link("body", walls + below)]
    for name, side in (("left", 1), ("right", -1)):
        board = shape(f"0.018 0.298 {high}", xyz=f"0.009 {-0.149 * side} {end + high / 2.0}")
        bar = shape("0.02 0.01 0.12", xyz=f"0.036 {-0.27 * side} {end + handle}")
        parts.append(link(name, board + bar))
        limit = "0 1.9" if side > 0 else "-1.9 0"
        parts.append(
            joint(f"hinge_{name}", "revolute", "body", name, xyz=f"{front} {0.3 * side} 0", axis="0 0 1", limit=limit)
        )
    if drawer:
        parts.append(link("drawer", shape("0.2 0.4 0.1", xyz="0 0 0.35")))
        parts.append(joint("slide", "prismatic", "body", "drawer", axis="1 0 0", limit="0 0.2"))
    return robot(*parts)


PLINTH = shape("0.26 0.6 0.1", xyz="-0.035 0 -0.05")
FEET = "".join(shape("0.04 0.04 0.1", xyz=f"{x} {y} -0.05") for x in (-0.14, 0.14) for y in (-0.27, 0.27))


def at_scales(item: Extraction) -> list[tuple[float, dict[str, Array]]]:
    """Scales, each with the links' points at it."""
    return [(scale, {name: part.points * scale for name, part in item.geometry.items()}) for scale in (1.0, 0.4)]


@pytest.mark.parametrize(
    ("urdf", "hangs"),
    [
        (cupboard(), True),
        (cupboard(handle=0.2), True),
        (cupboard(handle=0.62), False),  # gripped from above: a base unit
        (cupboard(handle=0.35), False),
        (cupboard(depth=0.58), False),
        (cupboard(below=PLINTH), False),
        (cupboard(below=FEET), False),
        (cupboard(end=0.1), False),
        (cupboard(drawer=True), False),
    ],
)
def test_what_is_made_as_wall_cupboards_are_is_told(tmp_path: Path, urdf: str, hangs: bool) -> None:
    item = read(written(tmp_path, urdf), "StorageFurniture")
    told = {
        category: [hangs_on_wall(item.features, clouds, scale, category) for scale, clouds in at_scales(item)]
        for category in ("StorageFurniture", "Refrigerator")
    }
    assert [bool(said) for said in told["StorageFurniture"]] == [hangs, hangs]
    assert told["Refrigerator"] == ["", ""], "of cupboards alone"


@pytest.mark.parametrize(
    ("words", "kind"),
    [("A cabinet, closed.", SupportKind.FIXED), ("A freestanding cabinet, closed.", SupportKind.FREESTANDING)],
)
@pytest.mark.parametrize("proposes", [False, True])
def test_it_is_fixed_as_a_guess_which_words_go_before(
    tmp_path: Path, words: str, kind: SupportKind, proposes: bool
) -> None:
    """Also where a model, as the tables do, says of all cabinets that they stand or lie."""
    item = read(written(tmp_path, cupboard()), "StorageFurniture")
    guidance = read_guidance(words, rounded_object_info(item.features))
    usual = usual_support(rounded_object_info(item.features), None)
    proposal = Overlay(scale=1.0, support=usual if proposes else None)
    overlay, _ = validate(item, proposal, Source.MODEL, 0.5, NO_VIEWS.physics, guidance=guidance)
    assert overlay.support.kind is kind
    if kind is SupportKind.FIXED:
        assert overlay.support.mount is Mount.WALL and overlay.support.confidence <= 0.5
        (finding,) = support_findings(overlay.support)
        assert (
            finding.severity is Severity.WARNING and "gripped at" in finding.message and "--support" in finding.message
        )


def flap_cupboard(hinge: float, axis: str = "0 1 0") -> str:
    """A cupboard of 0.7 m with a flap of 0.5 m, whose hinge is ``hinge`` over the bottom: opened by 110°, its outer
    edge is 0.5 sin 20° + 0.02 cos 20° = 0.19 m below the hinge."""
    return robot(
        link("body", shape("0.3 0.6 0.7", xyz="0 0 0.35")),
        link("flap", shape("0.02 0.6 0.5", xyz="0.01 0 0.25")),
        joint("fold", "revolute", "body", "flap", xyz=f"0.15 0 {hinge}", axis=axis, limit="0 2.2"),
    )


@pytest.mark.parametrize(
    ("hinge", "axis", "below"), [(0.1, "0 1 0", True), (0.16, "0 1 0", False), (0.1, "0 0 1", False)]
)
def test_a_flap_that_a_floor_would_stop_is_that_of_a_wall_cupboard(
    tmp_path: Path, hinge: float, axis: str, below: bool
) -> None:
    item = read(written(tmp_path, flap_cupboard(hinge, axis)), "StorageFurniture")
    for scale, clouds in at_scales(item):
        told = swings_below(item.features, clouds, scale, "StorageFurniture")
        assert ("13 % of its height below" in told) is below, told  # 0.09 m of 0.7
        assert swings_below(item.features, clouds, scale, "Oven") == ""


@pytest.mark.parametrize(
    ("sure", "words", "kind"),
    [
        (0.6, "A cabinet, closed.", SupportKind.FIXED),
        (0.9, "A cabinet, closed.", SupportKind.FREESTANDING),
        (0.6, "A freestanding cabinet, closed.", SupportKind.FREESTANDING),
    ],
)
def test_only_a_guess_that_it_stands_gives_way_to_its_flap(
    tmp_path: Path, sure: float, words: str, kind: SupportKind
) -> None:
    item = read(written(tmp_path, flap_cupboard(0.1)), "StorageFurniture")
    said = SupportProposal(kind=SupportKind.FREESTANDING, confidence=sure, reason="of such things")
    guidance = read_guidance(words, rounded_object_info(item.features))
    proposal = Overlay(scale=1.0, support=said)
    overlay, _ = validate(item, proposal, Source.PRIOR, 0.5, NO_VIEWS.physics, guidance=guidance)
    assert overlay.support.kind is kind


def fronted(hinge: float, axis: str = "0 1 0", below: str = "", flat: bool = False) -> str:
    """A cupboard of 0.4 m with a front of 0.4 m on a hinge ``hinge`` over its bottom, or a lid on top."""
    front = shape("0.3 0.9 0.02", xyz="-0.15 0 0.01") if flat else shape("0.02 0.9 0.4", xyz=f"0.01 0 {0.2 - hinge}")
    return robot(
        link("body", shape("0.3 0.9 0.4", xyz="0 0 0.2") + below),
        link("front", front),
        joint("fold", "revolute", "body", "front", xyz=f"0.15 0 {hinge}", axis=axis, limit="0 1.5"),
    )


@pytest.mark.parametrize(
    ("urdf", "hangs"),
    [
        (fronted(0.39, "0 -1 0"), True),
        (fronted(0.01), False),  # it drops
        (fronted(0.39, "0 0 1"), False),
        (fronted(0.39, "0 -1 0", FEET), False),
        (fronted(0.4, "0 1 0", flat=True), False),  # a lid
    ],
)
def test_fronts_that_are_lifted_are_those_of_wall_cupboards(tmp_path: Path, urdf: str, hangs: bool) -> None:
    item = read(written(tmp_path, urdf), "StorageFurniture")
    for scale, clouds in at_scales(item):
        assert bool(lifts_up(item.features, clouds, scale, "StorageFurniture")) is hangs
        assert lifts_up(item.features, clouds, scale, "Oven") == ""
