"""Suspensions: springs that carry an object are kept, at rest under its load, and no hand is to move them."""

from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from asset2sim.validation.validate import validate
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source
from tests.assets import joint, link, near, read, robot, shape, written

BODY_KG, FOOT_KG = 10.0, 0.5
INERTIAL = '<inertial><mass value="{m}"/><inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>'
SPRING = '<dynamics damping="20" spring_stiffness="2000" spring_reference="{}"/>'


def stool(folder: Path, *, axis: str = "0 0 -1", reference: float = 0.01, foot: str = "", spring: str = SPRING,
          lower: float = -0.03) -> Extraction:  # fmt: skip
    """A board on four sprung feet, weighed in metres; ``foot``: a fifth that is no part of the suspension."""
    corners = [(x, y) for x in (-0.4, 0.4) for y in (-0.2, 0.2)]
    body = link("body", INERTIAL.format(m=BODY_KG, i=0.5) + shape("1 0.5 0.1", xyz="0 0 0.25"))
    feet = "".join(
        link(f"foot_{n}", INERTIAL.format(m=FOOT_KG, i=0.001) + shape("0.08 0.08 0.1", xyz="0 0 0.05"))
        for n in range(4)
    )
    more = spring.format(reference)
    slides = "".join(
        joint(f"slide_{n}", "prismatic", "body", f"foot_{n}", xyz=f"{x} {y} 0.05", axis=axis, more=more,
              limit=f"{lower} 0.03")
        for n, (x, y) in enumerate(corners)
    )  # fmt: skip
    return read(written(folder, robot(body, feet, slides, foot)))


def completed(item: Extraction) -> PhysicsOverlay:
    return validate(item, Overlay(scale=1.0), Source.MODEL, 0.5, PhysicsSettings())[0]


@pytest.mark.parametrize("axis", ["0 0 -1", "0 0 1"])
def test_feet_rest_where_spring_and_load_balance(tmp_path: Path, axis: str) -> None:
    done = completed(stool(tmp_path, axis=axis, reference=0.02 if axis.endswith("-1") else -0.02))
    # Each bears a quarter of the board: 24.5 N shorten 2000 N/m by 12.3 mm, from 20 mm out.
    out = 0.02 - BODY_KG * GRAVITY_M_S2 / 4.0 / 2000.0
    for item in done.joints:
        assert item.stiffness == 2000.0 and item.stiffness_source is Source.AUTHORED and not item.holds
        assert near(item.initial_position, out if axis.endswith("-1") else -out, 1e-9)
        assert near(abs(item.spring_reference), 0.02)
        assert item.effort_range is not None and item.effort_range.most_n > 1e5, "no hand moves it"


def test_a_load_beyond_the_travel_rests_at_the_stop(tmp_path: Path) -> None:
    done = completed(stool(tmp_path, reference=-0.025))
    assert {item.initial_position for item in done.joints} == {-0.03}


def test_a_foot_that_stands_without_a_spring_carries_it(tmp_path: Path) -> None:
    prop = link("prop", INERTIAL.format(m=1.0, i=0.002) + shape("0.1 0.1 0.2", xyz="0 0 0.1"))
    fixed = prop + joint("held", "fixed", "body", "prop")
    done = completed(stool(tmp_path, foot=fixed))
    assert all(item.effort_range is not None and item.effort_range.most_n < 1e5 for item in done.joints)
    rests = {item.initial_position for item in done.joints if item.stiffness}
    assert all(at == pytest.approx(0.01 + FOOT_KG * GRAVITY_M_S2 / 2000.0) for at in rests)


def test_without_springs_nothing_is_a_suspension(tmp_path: Path) -> None:
    done = completed(stool(tmp_path, spring='<dynamics damping="20"/>'))
    assert all(item.stiffness == 0.0 and item.effort_range is not None for item in done.joints)
    assert all(item.effort_range.most_n < 1e5 for item in done.joints if item.effort_range)
