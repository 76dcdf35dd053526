"""Parts of objects that nobody here has seen do what such parts do, however they are labelled: they stay or return."""

from dataclasses import replace
from pathlib import Path

import pytest

from asset2sim.baselines.declared_method import known_methods
from schemas.asset import AssetRef
from schemas.overlay import JointPhysics, PhysicsOverlay
from tasks.extract import extract_asset
from tasks.job import AssetJob
from tasks.synthesize import with_users_numbers
from tasks.validate import validate_overlay
from tests.assets import NO_VIEWS, joint, link, prior, robot, shape, written

BODY = shape("0.04 0.04 0.2") + shape("0.15 0.025 0.025", xyz="0.06 0 0.09")
STICK = shape("0.1 0.02 0.012", xyz="0.04 0 0.006")
CROSS = shape("0.07 0.012 0.01") + shape("0.012 0.07 0.01")
DISC = "".join(
    f'<{tag}><geometry><cylinder radius="0.02" length="0.02"/></geometry></{tag}>' for tag in ("visual", "collision")
)
PLATE = shape("0.01 0.08 0.08")


def described(
    folder: Path, name: str, category: str, words: str, part: str, label: str, **hinge: str
) -> PhysicsOverlay:
    """The overlay of an object of a body (``hinge["body"]``) and one part, by the offline model and the rules."""
    body, kind = hinge.pop("body"), hinge.pop("kind")
    made = robot(link("base", body), link("part", part), joint("turn", kind, "base", "part", **hinge))
    files = {"semantics.txt": f"base free body\npart hinge {label}\n"} if label else {}
    ref = AssetRef(asset_id=name, path=str(written(folder / name, made, files)), category=category, prompt=words)
    job, method = AssetJob(ref, folder / "out", NO_VIEWS, prior), known_methods()[NO_VIEWS.method]
    extracted = extract_asset(job, correct_joints=True)
    job = replace(job, guidance=extracted.guidance)
    proposal = with_users_numbers(method.propose, job, extracted.extraction).proposal
    return validate_overlay(job, extracted.extraction, proposal, rules=True).overlay


def only(overlay: PhysicsOverlay) -> JointPhysics:
    (made,) = overlay.joints
    return made


@pytest.mark.parametrize("label", ["switch", "lever", "knob", "handle", "rocker", ""])
@pytest.mark.parametrize(
    ("part", "hinge"),
    [
        (STICK, {"kind": "revolute", "axis": "0 -1 0", "limit": "0 0.7"}),
        (CROSS, {"kind": "continuous", "axis": "0 0 1"}),
        (DISC, {"kind": "revolute", "axis": "0 0 1", "limit": "0 3"}),
    ],
    ids=["stick", "cross", "disc"],
)
def test_taps_stay_where_they_are_put(tmp_path: Path, label: str, part: str, hinge: dict[str, str]) -> None:
    overlay = described(tmp_path, "kitchen_tap", "Faucet", "A tap.", part, label, body=BODY, xyz="0 0 0.11", **hinge)
    made = only(overlay)
    assert made.stiffness == 0.0 and made.holds, "no spring brings it back"
    assert made.effort_range is not None and made.effort_range.kind == "tap handle"
    assert made.friction > 1.25 * abs(made.gravity_load)
    handle = next(link.mass_kg for link in overlay.links if link.name == "part")
    assert handle < 0.35, "a cast handle, and no solid one"


def test_an_object_of_no_stated_category_is_known_by_its_words(tmp_path: Path) -> None:
    hinge = {"kind": "revolute", "axis": "0 -1 0", "limit": "0 0.7", "xyz": "0 0 0.11"}
    made = only(described(tmp_path, "thing_7", "", "A dripping tap.", STICK, "", body=BODY, **hinge))
    assert made.effort_range is not None and made.effort_range.kind == "tap handle" and made.holds


@pytest.mark.parametrize("label", ["switch", "lever", "button", "slider", ""])
def test_wall_switches_take_what_rockers_take(tmp_path: Path, label: str) -> None:
    hinge = {"kind": "revolute", "axis": "0 1 0", "limit": "-0.12 0.12", "xyz": "-0.008 0 0"}
    part = shape("0.008 0.03 0.05")
    made = only(described(tmp_path, "switch_3", "Switch", "A light switch.", part, label, body=PLATE, **hinge))
    assert made.effort_range is not None and made.effort_range.kind == "rocker or toggle" and made.holds
    assert made.friction >= 0.5 * 2.8 * 0.02


@pytest.mark.parametrize(
    ("category", "words", "label", "part", "kind", "holds"),
    [
        ("", "A ball valve.", "lever", STICK, "lever", True),
        ("", "A jar with a lid.", "lid", DISC, "screw lid", True),
        ("KitchenPot", "A pot.", "lid", DISC, "lid that lies loose", False),
        ("Toilet", "A toilet.", "lever", STICK, "lever", False),
        ("Lamp", "A lamp with a rocker.", "rocker", shape("0.03 0.02 0.008"), "rocker or toggle", True),
    ],
)
def test_other_parts_stay_or_return(
    tmp_path: Path, category: str, words: str, label: str, part: str, kind: str, holds: bool
) -> None:
    turns = part is DISC
    hinge = (
        {"kind": "continuous", "axis": "0 0 1"} if turns else {"kind": "revolute", "axis": "0 -1 0", "limit": "0 1.5"}
    )
    made = only(described(tmp_path, "thing", category, words, part, label, body=BODY, xyz="0 0 0.12", **hinge))
    assert made.effort_range is not None and made.effort_range.kind == kind
    assert made.holds is holds and (made.stiffness > 0.0) is (category == "Toilet")
