"""A model that disagrees with a number of a file in metres: what is recorded, and which of the two stands."""

import functools
import json
from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.models.answers import overlay_schema, parse_overlay
from asset2sim.models.ask_overlay import ask_overlay
from asset2sim.models.gateway.ask import ask
from asset2sim.models.prompts import DIRECT, SYNTHESIS, overlay_request
from asset2sim.validation.validate import validate
from schemas.errors import InvalidAnswerError
from schemas.finding import Finding
from schemas.overlay import Disagreement, Overlay, PhysicsOverlay
from schemas.settings import ModelSettings, PhysicsSettings
from schemas.vocabulary import Source
from tests.model_server import Reply, serve
from tests.scripted_server import information
from tests.test_validation_trust import LIGHT, cabinet, of

HINGE = 'damping="0.8" friction="1.2"'
SEEN = "the door is a thin sheet of glass"


def settled(item: Extraction, *said: Disagreement, answer: Overlay = LIGHT) -> tuple[PhysicsOverlay, list[Finding]]:
    overlay = answer.model_copy(update={"disagrees": said})
    done, findings = validate(item, overlay, Source.MODEL, 0.5, PhysicsSettings())
    return done, [found for found in findings if found.code == "authored_disputed"]


def door_kg(overlay: PhysicsOverlay) -> tuple[float, Source]:
    (door,) = (link for link in overlay.links if link.name == "door")
    return door.mass_kg, door.mass_source


@pytest.mark.parametrize(
    ("value", "why", "stands", "word"),
    [
        (9.5, SEEN, "model", "over 3 times off"),
        (0.4, SEEN, "model", "over 3 times off"),
        (8.0, SEEN, "file", "within 3 times"),
        (9.5, " ", "file", "gives no reason"),
        (60.0, SEEN, "file", "not 5 to 12000 kg/m³"),
        (-1.0, SEEN, "file", "no body is without mass"),
    ],
)
def test_of_a_plausible_mass_a_far_one_with_a_reason_stands(
    value: float, why: str, stands: str, word: str, tmp_path: Path
) -> None:
    said = Disagreement(quantity="mass", about="door", value=value, why=why)
    overlay, (found,) = settled(cabinet(tmp_path / "a", HINGE), said)
    mass, source = door_kg(overlay)
    assert (mass, source) == pytest.approx((value, Source.MODEL) if stands == "model" else (3.0, Source.AUTHORED))
    assert word in found.message and f"the {stands}'s sta" in found.message
    assert (found.value, found.limit, found.link) == (3.0, value, "door") and why in found.message
    (body,) = (link for link in overlay.links if link.name == "body")
    assert body.mass_source is Source.AUTHORED, "of another part nothing was said"


def test_what_a_file_has_wrong_goes_to_the_model_and_what_is_kept_by_name_does_not(tmp_path: Path) -> None:
    said = Disagreement(quantity="mass", about="door", value=2.5, why=SEEN)
    overlay, (found,) = settled(cabinet(tmp_path / "a", door_kg=90.0), said)
    assert door_kg(overlay) == (2.5, Source.MODEL) and "as the file's is not 5 to 12000" in found.message
    overlay, (found,) = settled(cabinet(tmp_path / "b", door_kg=90.0, keep=("plausible", "mass")), said)
    assert door_kg(overlay) == (90.0, Source.AUTHORED) and "kept as asked" in found.message
    overlay, nothing = settled(cabinet(tmp_path / "c", door_kg=90.0, keep=("nothing",)), said)
    assert nothing == [] and door_kg(overlay)[1] is Source.MODEL, "nothing of the file is kept, so nothing is disputed"


def test_terms_of_joints_are_disputed_alike_and_the_size_is_the_users(tmp_path: Path) -> None:
    item = cabinet(tmp_path / "a", HINGE, 'damping="6" friction="4"')
    overlay, (damping, size) = sorted_by_message(
        *settled(
            item,
            Disagreement(quantity="damping", about="door_hinge", value=0.1, why=SEEN),
            Disagreement(quantity="size", value=0.5, why="such cabinets are smaller"),
        )
    )
    hinge = of(overlay, "door_hinge")
    assert hinge.damping == pytest.approx(0.1) and hinge.damping_source is Source.MODEL
    assert (hinge.friction, hinge.friction_source) == (1.2, Source.AUTHORED)
    assert of(overlay, "drawer_slide").damping == 6.0 and damping.joint == "door_hinge"
    assert overlay.scale == 1.0 and "the user's to ask for" in size.message


def sorted_by_message(overlay: PhysicsOverlay, found: list[Finding]) -> tuple[PhysicsOverlay, list[Finding]]:
    return overlay, sorted(found, key=lambda item: item.message)


def test_only_of_a_file_in_metres_a_model_is_asked_and_names_must_be_known(tmp_path: Path) -> None:
    metric, unknown = cabinet(tmp_path / "a", HINGE), cabinet(tmp_path / "b", HINGE, weighed=False)
    asked, plain = (overlay_request(SYNTHESIS, item.features, None) for item in (metric, unknown))
    assert "# Numbers of its file" in asked.system and "disagrees" in json.dumps(asked.answer_schema)
    assert "disagrees" not in plain.system and "disagrees" not in json.dumps(plain.answer_schema)
    assert "disagrees" not in json.dumps(overlay_schema(DIRECT))
    said = '{"scale": 1, "disagrees": [{"quantity": "mass", "about": "door_hinge", "value": 1, "why": "x"}]}'
    with pytest.raises(InvalidAnswerError, match=r"disagrees\[0\].about: 'door_hinge' has no mass; choose from body"):
        parse_overlay(said, metric.features)


@pytest.mark.system
def test_over_http_a_model_reads_what_is_stated_and_its_objection_comes_to_a_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    item = cabinet(tmp_path / "a", HINGE)
    answer = {"scale": 1.0, "links": [{"name": "door", "density_kg_m3": 40.0}], "disagrees": [
        {"quantity": "mass", "about": "door", "value": 0.5, "why": SEEN},
        {"quantity": "friction", "about": "door_hinge", "value": 1.0, "why": "it looks smooth"},
    ]}  # fmt: skip
    with serve([Reply(json.dumps(answer))]) as server:
        settings = ModelSettings(model="openai/scripted", api_base=server.api_base, timeout_s=60.0, max_attempts=2)
        request = overlay_request(SYNTHESIS, item.features, "a glazed cabinet")
        overlay, calls, _ = ask_overlay(request, item.features, functools.partial(ask, settings=settings))
    told = information(server.requests[0]["messages"][1]["content"])
    assert {link["name"]: link["mass_kg"] for link in told["links"]} == {"body": 20.0, "door": 3.0, "drawer": 1.5}
    assert told["joints"][0]["file_states"] == {"damping": 0.8, "friction": 1.2} and len(calls) == 1
    done, findings = validate(item, overlay, Source.MODEL, 0.5, PhysicsSettings())
    disputed = {found.link or found.joint: found for found in findings if found.code == "authored_disputed"}
    assert door_kg(done) == (0.5, Source.MODEL) and SEEN in disputed["door"].message
    assert of(done, "door_hinge").friction == 1.2 and "the file's stays" in disputed["door_hinge"].message
