"""Masses by construction: walls, contents, and the centre and inertia that follow from them."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.assets.meshes.volume import shape_of
from asset2sim.assets.solids import PlacedShape, shapes_with_mass
from asset2sim.models.prompts import SYNTHESIS, overlay_request
from asset2sim.physics.arrays import Array, floats_of
from asset2sim.physics.inertia import box_inertia
from asset2sim.validation.build import Built, built_link
from asset2sim.validation.mass_bounds import bounded_inertia
from asset2sim.validation.sanity import convert_link_units
from asset2sim.validation.validate import validate
from schemas.features import LinkFeatures
from schemas.finding import Notes
from schemas.overlay import Content, LinkProposal, MassChange, Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import MassRule, Severity, Source
from tests.assets import joint, link, prior, read, robot, shape, written
from tests.builders import corners, is_physical
from tests.factories import make_features
from tests.test_assets_surface import shell_moments

SETTINGS = PhysicsSettings()
A, B, C = 0.8, 0.6, 0.4
AREA = 2.0 * (A * B + B * C + A * C)


@pytest.fixture
def body(tmp_path: Path) -> LinkFeatures:
    """A box of 0.8 by 0.6 by 0.4 m about the origin."""
    return read(written(tmp_path, robot(link("a", shape(f"{A} {B} {C}"))))).features.links[0]


def built(body: LinkFeatures, scale: float = 1.0, **fields: object) -> Built:
    proposal = LinkProposal.model_validate({"name": "a", "density_kg_m3": 1000.0, **fields})
    return built_link(body, proposal, scale, SETTINGS, np.eye(3))


def test_a_thin_box_weighs_its_walls_and_turns_as_a_shell(body: LinkFeatures) -> None:
    found = built(body, wall_m=1e-6)
    assert found.rule is MassRule.SHELL and found.mass == pytest.approx(AREA * 1e-6 * 1000.0)
    np.testing.assert_allclose(np.diag(found.unit_inertia), shell_moments(A, B, C), rtol=1e-4)


def test_a_wall_stays_as_thick_when_the_object_grows(body: LinkFeatures) -> None:
    assert built(body, 2.0, wall_m=1e-3).mass == pytest.approx(4.0 * built(body, wall_m=1e-3).mass)


def test_walls_never_fill_more_than_the_hull_and_a_full_one_is_solid(body: LinkFeatures) -> None:
    found = built(body, wall_m=1.0)
    assert found.mass == pytest.approx(A * B * C * 1000.0)
    np.testing.assert_allclose(np.diag(found.unit_inertia)[0], (B * B + C * C) / 12.0, rtol=1e-9)


def test_a_hollow_factor_lies_between_solid_and_shell(body: LinkFeatures) -> None:
    moments = [built(body, hollow_factor=share).unit_inertia[0, 0] for share in (1.0, 0.5, 1e-3)]
    assert moments[0] == pytest.approx((B * B + C * C) / 12.0)
    assert moments[0] < moments[1] < moments[2] == pytest.approx(shell_moments(A, B, C)[0], rel=1e-3)


def test_contents_stand_in_their_place_by_the_parallel_axis_theorem(body: LinkFeatures) -> None:
    stone = Content(name="stone", mass_kg=2.0, at=(0.5, 0.5, 0.0), extent=0.0)
    found = built(body, wall_m=1e-3, contents=(stone,))
    wall = AREA * 1e-3 * 1000.0
    assert found.mass == pytest.approx(wall + 2.0)
    assert found.com[2] == pytest.approx(-2.0 * C / 2.0 / found.mass)
    apart = wall * 2.0 / found.mass * (C / 2.0) ** 2
    plain = built(body, wall_m=1e-3)
    expected = wall * plain.unit_inertia[0, 0] + apart
    assert found.mass * found.unit_inertia[0, 0] == pytest.approx(expected)


def test_a_lamps_weight_is_over_its_foot_and_what_stands_higher_or_aside_is_not(tmp_path: Path) -> None:
    """A plate of 0.4 m with an arm over 1.2 m: its foot is a sixth of the way along its box."""
    text = robot(link("a", shape("0.4 0.4 0.02", xyz="0 0 0.01") + shape("1 0.04 0.04", xyz="0.5 0 1.4")))
    item = read(written(tmp_path, text))
    assert item.features.link_feet == {"a": pytest.approx((1 / 6, 0.5), abs=1e-3)}
    lamp = item.features.links[0]

    def centre(at: tuple[float, float, float]) -> float:
        weight = Content(name="weight in the foot", mass_kg=1e6, at=at)
        proposal = LinkProposal(name="a", density_kg_m3=1000.0, hollow_factor=1e-3, contents=(weight,))
        return float(built_link(lamp, proposal, 1.0, SETTINGS, np.eye(3), foot=item.features.link_feet["a"]).com[0])

    assert centre((0.5, 0.5, 0.03)) == pytest.approx(0.0, abs=1e-3)
    assert centre((0.5, 0.5, 0.6)) == pytest.approx(0.4, abs=1e-3)
    assert centre((0.95, 0.5, 0.05)) == pytest.approx(0.94, abs=1e-3), "a compressor at the back"


def test_contents_are_placed_upright_in_a_link_whose_frame_lies_on_its_side(body: LinkFeatures) -> None:
    """PartNet-Mobility's links have y up: z of the root is their y."""
    to_root = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    stone = Content(name="stone", mass_kg=1e3, at=(0.5, 0.5, 0.0), extent=0.0)
    proposal = LinkProposal(name="a", density_kg_m3=1.0, wall_m=1e-3, contents=(stone,))
    found = built_link(body, proposal, 1.0, SETTINGS, to_root)
    np.testing.assert_allclose(found.com, (0.0, -B / 2.0, 0.0), atol=1e-3)


def test_how_a_mass_was_made_is_recorded_and_a_fitted_one_is_a_finding(tmp_path: Path) -> None:
    extraction = read(written(tmp_path, robot(link("a", shape(f"{A} {B} {C}")))))
    links = (LinkProposal(name="a", density_kg_m3=1000.0, wall_m=1e-3),)
    for asked, severity in ((False, Severity.WARNING), (True, Severity.INFO)):
        change = MassChange(from_kg=1.0, to_kg=2.0, why="1.9 to 3 kg for Box", asked=asked)
        overlay, findings = validate(
            extraction, Overlay(scale=1.0, links=links, mass_change=change), Source.PRIOR, 0.5, SETTINGS
        )
        (part,) = overlay.links
        assert (part.mass_rule, part.wall_m) == (MassRule.SHELL, 1e-3) and part.outer_m2 == pytest.approx(AREA)
        (found,) = [finding for finding in findings if finding.code == "mass_fitted"]
        assert (found.severity, found.value, found.limit) == (severity, 1.0, 2.0)


@pytest.mark.parametrize("drawn_m", [1e-4, 3e-3])
@pytest.mark.parametrize(
    ("category", "label", "least", "most"),
    [
        ("Refrigerator", "rotation_door", 6.0, 9.0),  # see the material's source
        ("Safe", "rotation_door", 31.0, 55.0),  # plate of 4 to 6 mm and its bolts
        ("Oven", "rotation_door", 15.0, 25.0),  # two or three panes of 3 to 4 mm
        ("Window", "rotation_window", 15.0, 25.0),  # two panes of 3 to 5 mm
        ("StorageFurniture", "rotation_door", 9.0, 13.0),  # boards of 15 to 18 mm
        ("*", "rotation_door", 3.0, 8.0),  # no known category: 3 to 7 mm of plastic
    ],
)
def test_a_door_drawn_as_a_sheet_is_as_heavy_as_its_kind(
    tmp_path: Path, drawn_m: float, category: str, label: str, least: float, most: float
) -> None:
    """However thin it is drawn; kg/m². A mass stated for it is none that no material has. The body's edges are none of
    a drawing in metres, so that each kind gets its usual size: a refrigerator of 0.7 m has thinner walls."""
    width, height = 0.48, 0.68
    urdf = robot(
        link("body", shape("0.50003 0.50003 0.70003")),
        link("leaf", shape(f"{drawn_m} {width} {height}", xyz=f"0 {width / 2} 0")),
        joint("hinge", "revolute", "body", "leaf", xyz="-0.26 -0.24 0", axis="0 0 1", limit="0 1.6"),
    )
    folder = written(tmp_path / "thing", urdf, {"semantics.txt": f"body hinge body\nleaf hinge {label}\n"})
    extraction = read(folder, category)
    answer = prior(overlay_request(SYNTHESIS, extraction.features, "")).content
    assert answer is not None
    overlay = Overlay.model_validate_json(answer)
    done, _ = validate(extraction, overlay, Source.PRIOR, 0.5, SETTINGS)
    leaf = next(item for item in done.links if item.name == "leaf")
    assert least <= leaf.mass_kg / (width * height * done.scale**2) <= most
    stated = overlay.model_copy(update={"links": (LinkProposal(name="leaf", mass_kg=2.0 * leaf.mass_kg),)})
    done, findings = validate(extraction, stated, Source.MODEL, 0.5, SETTINGS)
    assert "mass_implausible" not in {finding.code for finding in findings}
    for density, hollow in ((7850.0, 0.4), (2500.0, 0.2)):
        share = LinkProposal(name="leaf", density_kg_m3=density, hollow_factor=hollow)
        answered = overlay.model_copy(update={"links": (share,)})
        done, findings = validate(extraction, answered, Source.MODEL, 0.5, SETTINGS)
        leaf = next(item for item in done.links if item.name == "leaf")
        if drawn_m < 1e-3:
            assert least <= leaf.mass_kg / (width * height * done.scale**2) <= most
            assert leaf.density_kg_m3 == density and "sheet_thickened" in {finding.code for finding in findings}
        by_user = answered.model_copy(update={"asked": ("links.leaf.mass_kg",)})
        theirs, _ = validate(extraction, by_user, Source.MODEL, 0.5, SETTINGS)
        volume = drawn_m * width * height * theirs.scale**3
        assert theirs.links[1].mass_kg == pytest.approx(volume * density * hollow, rel=0.01), "the user's own stays"


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


edges = st.floats(1e-3, 1.0)


def cube_points(size: Array) -> Array:
    """The eight corners of a box of edge lengths ``size`` about the origin."""
    return corners(floats_of(-size / 2.0), floats_of(size / 2.0))


def test_a_solid_box_is_left_as_it_is_and_a_placeholder_is_lowered_to_the_faces() -> None:
    size = np.array([0.2, 0.1, 0.05])
    assert bounded_inertia(box_inertia(2.0, size), 2.0, cube_points(size), 1e-4) is None
    lowered = bounded_inertia(np.eye(3), 2.0, cube_points(size), 1e-4)
    assert lowered is not None
    moments = 2.0 * (size / 2.0) ** 2
    np.testing.assert_allclose(lowered, np.diag(moments.sum() - moments), rtol=1e-9)


def test_a_sheet_keeps_the_thickness_that_it_is_given() -> None:
    flat = cube_points(np.array([0.2, 0.2, 0.0]))
    lowered = bounded_inertia(np.eye(3), 1.0, flat, 1e-3)
    assert lowered is not None
    assert lowered[0, 0] == pytest.approx(0.1**2 + 1e-3**2) and is_physical(lowered)


@settings(max_examples=60, deadline=None)
@given(st.tuples(edges, edges, edges), st.floats(0.1, 50.0))
def test_whatever_comes_out_is_an_inertia_that_a_body_can_have(size: tuple[float, ...], factor: float) -> None:
    box = np.array(size)
    bounded = bounded_inertia(factor * box_inertia(1.0, box), 1.0, cube_points(box), 1e-4)
    if bounded is None:
        assert factor <= 3.0 * (1.0 + 1e-5), "a shell has three times the second moments of a solid box"
    else:
        assert is_physical(bounded)


def placed(size: tuple[float, float, float], at: tuple[float, float, float]) -> PlacedShape:
    """A box, flat where an edge is zero, at a place."""
    mesh = trimesh.creation.box(extents=size)
    mesh.apply_translation(at)
    return PlacedShape(shape_of(mesh), np.eye(3), np.zeros(3), None)


def test_a_pane_beside_its_handle_has_a_mass_and_a_sticker_has_none() -> None:
    handle, pane = placed((0.02, 0.1, 0.02), (0.0, 0.0, 0.0)), placed((0.5, 0.4, 0.0), (0.25, 0.0, 0.0))
    sticker = placed((0.01, 0.05, 0.0), (0.0, 0.0, 0.01))
    assert shapes_with_mass([handle, pane, sticker]) == [handle, pane]
    assert shapes_with_mass([pane]) == [pane]
