"""Our pipeline without semantics: what goes out names nothing, and what comes back fits the asset."""

import json
import re
from pathlib import Path

import pytest

from asset2sim.intake.origin import extract
from asset2sim.models.gateway.recorded import UnrecordedError, find_answer
from asset2sim.models.prompts import SYNTHESIS, overlay_request, with_validation_errors
from lab.methods.no_semantics import anonymized_request, name_aliases, restored, without_semantics
from schemas.features import Features
from schemas.overlay import Overlay
from schemas.request import LabelledImage, ModelAnswer, ModelRequest, Turn
from schemas.vocabulary import Method, Status
from tests.assets import prior, sample, saying
from tests.factories import make_features
from tests.methods_runs import run, settings_of

BLIND = settings_of(Method.NO_SEMANTICS)


def semantic_strings(features: Features) -> set[str]:
    """Everything that the asset says of what it is: more than one letter, and no word of URDF's own."""
    words = {features.asset_id, features.category, features.urdf_file, *(joint.name for joint in features.joints)}
    for link in features.links:
        words |= {link.name, link.label, link.joint_kind, *link.materials, *(mesh.file for mesh in link.meshes)}
    neutral = re.compile(r"(link|joint)_\d+|")
    return {word for word in words if not neutral.fullmatch(word)}


def outside_guidance(request: ModelRequest) -> str:
    """What a request says in values and keys, guidance and system prompt aside."""
    texts = [request.text, *(turn.content for turn in request.turns)]
    return "\n".join(re.sub(r"<user_guidance>.*?</user_guidance>", "", text, flags=re.DOTALL) for text in texts)


def leaks(request: ModelRequest, words: set[str]) -> set[str]:
    """Which of the words occur as words; keys of ours ("links", "label") are no leak."""
    text = re.sub(r'"\w+":', "", outside_guidance(request))
    return {word for word in words if re.search(rf"(?<!\w){re.escape(word)}(?!\w)", text, re.IGNORECASE)}


@pytest.mark.parametrize("asset_id", ["stapler_desk", "laptop_silver", "storage_sideboard", "keyboard_compact"])
def test_no_semantic_string_of_the_asset_is_in_the_request(asset_id: str) -> None:
    ref = sample(asset_id)
    extraction = extract(ref)
    features, words = extraction.features, semantic_strings(extraction.features)
    plain = overlay_request(SYNTHESIS, features, ref.prompt)
    assert len(leaks(plain, words)) >= 4, "the test can fail"
    refused = with_validation_errors(plain, [f"links[0].name: unknown; links are: {', '.join(words)}"])
    for request in (plain, refused):
        blind = anonymized_request(request, name_aliases(features))
        assert leaks(blind, words) == set()
        assert json.dumps(ref.prompt, ensure_ascii=False) in blind.text, "the user's words are not the asset's"


def test_everything_else_of_the_request_stays() -> None:
    image = LabelledImage(label="front", png=b"png")
    plain = overlay_request(
        SYNTHESIS, make_features("7").model_copy(update={"link_centers": {"door": (0.0, 1.0, 2.0)}}), "a box", [image]
    )
    blind = anonymized_request(plain, name_aliases(make_features("7")))
    assert (blind.images, blind.system, blind.answer_schema) == (plain.images, plain.system, plain.answer_schema)
    before, after = (json.loads(re.findall(r"<structured_information>\n(.*)\n<", r.text)[0]) for r in (plain, blind))
    assert (after["purpose"], after["asset_id"], after["category"]) == ("synthesis", "", "")
    hidden = ("name", "label", "joint_kind", "materials", "parent", "child")
    for kind in ("links", "joints"):
        for one, two in zip(before[kind], after[kind], strict=True):
            assert {k: v for k, v in one.items() if k not in hidden} == {
                k: v for k, v in two.items() if k not in hidden
            }
    assert [link["name"] for link in after["links"]] == ["link_0", "link_1", "link_2", "link_3"]
    assert [(j["name"], j["parent"], j["child"], j["type"]) for j in after["joints"]] == [
        ("joint_0", "link_0", "link_1", "fixed"), ("joint_1", "link_1", "link_2", "revolute"),
        ("joint_2", "link_1", "link_3", "prismatic"),
    ]  # fmt: skip


def test_an_answer_comes_back_in_the_assets_own_names() -> None:
    features = make_features("7")
    answer = {
        "scale": 0.2, "links": [{"name": "link_2", "mass_kg": 1.0}], "joints": [{"name": "joint_2", "damping": 1.0}],
        "initial_joint_positions": {"joint_1": 0.5}, "asked": ["joint_1", "joint_2.damping"],
        "sigmas": {"links.link_2.mass_kg": 0.1}, "notes": ["link_2 on joint_1 (link_20 is none)"],
    }  # fmt: skip
    asked = without_semantics(saying(answer), features)
    got = asked(overlay_request("synthesis", features, ""))
    overlay = Overlay.model_validate_json(got.content or "")
    assert (overlay.links[0].name, overlay.joints[0].name) == ("door", "slider")
    assert overlay.initial_joint_positions == {"hinge": 0.5} and overlay.asked == ("hinge", "slider.damping")
    assert overlay.sigmas == {"links.door.mass_kg": 0.1} and overlay.notes == ("door on hinge (link_20 is none)",)


def test_names_that_are_aliases_of_other_parts_are_told_apart() -> None:
    """PartNet's own names are base, link_0, link_1: every alias but the last is the name of another part."""
    features = make_features("7")
    renamed = dict(zip(("base", "body", "door", "drawer"), ("base", "link_0", "link_1", "link_2"), strict=True))
    features = features.model_copy(
        update={
            "links": tuple(link.model_copy(update={"name": renamed[link.name]}) for link in features.links),
            "joints": tuple(
                joint.model_copy(update={"parent": renamed[joint.parent], "child": renamed[joint.child]})
                for joint in features.joints
            ),
        }
    )
    alias_map = name_aliases(features)
    for name, alias in (("base", "link_0"), ("link_0", "link_1"), ("link_2", "link_3")):
        assert alias_map.aliases[name] == alias
        assert json.loads(restored(json.dumps({"name": alias, "of": [name]}), alias_map))["name"] == name
    sentence = with_validation_errors(ModelRequest(purpose="x", system="", text=""), ["base, link_0 and link_1"])
    assert '"link_0, link_1 and link_2"' in anonymized_request(sentence, alias_map).text


def test_what_is_no_json_is_left_for_whoever_reads_it() -> None:
    alias_map = name_aliases(make_features("7"))
    assert restored("I would rather not, link_0", alias_map) == "I would rather not, link_0"
    deep = "[" * 5000 + "]" * 5000
    assert restored(deep, alias_map) == deep


def test_turns_of_a_conversation_are_disguised_too() -> None:
    features = make_features("7")
    turns = (
        Turn(role="assistant", content='{"joints": [{"name": "hinge"}], "deltas": {"hinge": 0.1}}'),
        Turn(role="user", content="the Box still overlaps its door"),
    )
    request = ModelRequest(purpose="refinement", system="", text="", turns=turns)
    first, second = anonymized_request(request, name_aliases(features)).turns
    assert json.loads(first.content) == {"joints": [{"name": "joint_1"}], "deltas": {"joint_1": 0.1}}
    assert second.content == "the part still overlaps its link_2"


def test_an_asker_that_fails_is_passed_on() -> None:
    failed = ModelAnswer(content=None, calls=(), error="HTTP 500")
    request = ModelRequest(purpose="x", system="", text="no blocks")
    assert without_semantics(lambda request: failed, make_features("7"))(request) == failed


@pytest.mark.system
@pytest.mark.parametrize("asset_id", ["laptop_silver", "planted_crossed_flaps"])
def test_the_whole_pipeline_runs_on_it(tmp_path: Path, asset_id: str) -> None:
    record, requests = run(sample(asset_id), tmp_path, BLIND)
    assert record.features is not None and record.overlay is not None and requests
    words = semantic_strings(record.features)
    assert words and [leaks(request, words) for request in requests] == [set()] * len(requests)
    assert {link.name for link in record.overlay.links} == {link.name for link in record.features.links}
    assert record.method is Method.NO_SEMANTICS and record.category == record.features.category != ""
    if asset_id == "laptop_silver":
        assert record.status is Status.OK, record.reason
        assert record.overlay.initial_positions == {"joint_0": pytest.approx(record.overlay.joints[0].initial_position)}
        named, _ = run(sample(asset_id), tmp_path, settings_of(Method.ASSET2SIM), prior)
        assert named.overlay is not None and named.overlay.links != record.overlay.links, "labels say something"


def test_an_answer_recorded_for_ours_is_none_to_the_question_without_semantics(tmp_path: Path) -> None:
    features = make_features("7")
    request = anonymized_request(overlay_request(SYNTHESIS, features, None), name_aliases(features))
    (tmp_path / "7.json").write_text("{}", encoding="utf-8")
    with pytest.raises(UnrecordedError, match=r"7\.no_semantics\.json"):
        find_answer(tmp_path, "7", request, 1)
