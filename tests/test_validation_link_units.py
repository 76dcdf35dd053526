"""Densities in g/cm³ and walls in millimetres are converted where they cannot be anything else."""

import pytest

from asset2sim.validation.sanity import convert_link_units
from schemas.finding import Notes
from schemas.overlay import LinkProposal, Overlay
from tests.factories import make_features


def converted(scale: float = 0.25, **fields: float) -> tuple[LinkProposal, list[str]]:
    notes = Notes()
    proposal = Overlay(scale=scale, links=(LinkProposal(name="body", **fields),))
    (link,) = convert_link_units(make_features("7"), proposal, notes).links
    return link, [finding.code for finding in notes.findings]


@pytest.mark.parametrize(("said", "meant"), [(0.7, 700.0), (2.7, 2700.0), (7.85, 7850.0)])
def test_a_density_that_no_solid_has_is_in_g_cm3(said: float, meant: float) -> None:
    link, codes = converted(density_kg_m3=said)
    assert link.density_kg_m3 == pytest.approx(meant) and codes == ["density_in_g_cm3"]


@pytest.mark.parametrize(("said", "meant"), [(2.0, 0.002), (16.0, 0.016), (0.8, 0.0008)])
def test_a_wall_thicker_than_its_link_is_in_millimetres(said: float, meant: float) -> None:
    link, codes = converted(wall_m=said)
    assert link.wall_m == pytest.approx(meant) and codes == ["wall_in_millimetres"]


@pytest.mark.parametrize("fields", [{"density_kg_m3": 15.0}, {"density_kg_m3": 900.0}, {"wall_m": 0.016}, {}])
def test_what_may_be_meant_stays(fields: dict[str, float]) -> None:
    link, codes = converted(**fields)
    assert link == LinkProposal(name="body", **fields) and codes == []


def test_a_thick_wall_of_a_large_thing_stays() -> None:
    assert converted(scale=3.0, wall_m=0.2) == (LinkProposal(name="body", wall_m=0.2), [])
