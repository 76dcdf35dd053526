"""A user's sentence is read once an asset, into a record that says where each wish was read."""

import sys
from pathlib import Path
from types import FrameType

from asset2sim.baselines.ours import by_rules
from asset2sim.checks.alignment.align import align
from asset2sim.guidance import lexicon, read
from schemas.asset import AssetRef
from schemas.guidance import NOTHING_ASKED
from schemas.settings import Settings
from tasks.extract import extract_asset
from tasks.progress import AssetJob
from tasks.synthesize import check_users_numbers
from tasks.validate import validate_overlay
from tests.assets import NO_VIEWS, cabinet, saying, written
from tests.factories import guidance_of, make_features, make_record

WORDS = "A small steel box of 2 kg with its door slightly open and its drawer closed, low hinge damping."


def test_each_wish_has_the_words_and_the_place_where_it_was_read() -> None:
    found = guidance_of(WORDS, make_features("1"))
    door, drawer = found.states
    assert (door.joint, door.state.slightly, door.words) == ("hinge", True, "its door slightly open")
    assert (drawer.joint, drawer.state.share) == ("slider", 0.0) and drawer.at > door.at > 0
    assert [(wish.named, wish.changes) for wish in found.motions] == [(("hinge",), {"damping": "low"})]
    assert found.mass is not None and (found.mass.mass_kg, found.mass.words) == (2.0, "2 kg")
    assert [(item.part, item.material) for item in found.materials] == [("", "steel")]
    assert [word.words for word in found.size.words] == ["small"]


def test_a_number_of_the_users_stands_in_only_where_the_sentence_states_none() -> None:
    scaled = NOTHING_ASKED.scaled_to(0.25)
    assert scaled.size.scale is not None and scaled.size.scale.value == 0.25
    assert scaled.scaled_to(0.5) == scaled


def test_from_extraction_to_the_score_the_sentence_is_read_once(tmp_path: Path) -> None:
    calls: list[str] = []

    def count(frame: FrameType, event: str, arg: object) -> None:
        if event == "call" and frame.f_code in (lexicon.tokenize.__code__, read.read_guidance.__wrapped__.__code__):
            calls.append(frame.f_code.co_name)

    folder = written(tmp_path / "thing", cabinet())
    ref = AssetRef(asset_id="thing", path=str(folder), category="Box", prompt="A small box, its lid slightly open.")
    settings = Settings(views=NO_VIEWS.views)
    ask = saying({"scale": 0.3, "initial_joint_positions": {"lid_hinge": 0.2}, "asked": ["lid_hinge"]})
    job = AssetJob(ref, tmp_path, settings, ask)
    sys.setprofile(count)
    try:
        extracted = extract_asset(job, correct_joints=True)
        job = AssetJob(ref, tmp_path, settings, ask, extracted.guidance)
        check_users_numbers(job, extracted.extraction)
        proposal, _, _ = by_rules(job, extracted.extraction)
        overlay = validate_overlay(job, extracted.extraction, proposal, rules=True).overlay
        features, guidance = extracted.features, extracted.guidance
        record = make_record("thing", ref=ref, overlay=overlay, features=features, guidance=guidance, measurement=None)
        found = align(record)
    finally:
        sys.setprofile(None)
    assert found is not None and calls == ["read_guidance", "tokenize"]
