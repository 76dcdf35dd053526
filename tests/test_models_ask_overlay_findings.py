"""A model's remarks and reasons as findings of the asset."""

from asset2sim.models.answers import parse_overlay
from asset2sim.models.ask_overlay import CODES, model_findings
from schemas.vocabulary import Severity
from tests.factories import make_features

ANSWER = """{"size_reason": "a desk stapler, 15 cm long", "scale": 0.08, "restitution": 0.4, "contact_friction": 0.3,
 "links": [{"name": "door", "appearance": "thin, dull", "density_kg_m3": 900}],
 "findings": [{"kind": "data", "about": "door", "text": "overlaps the body"},
              {"kind": "unmet", "about": "hinge", "text": "no spring there"}, {"kind": "mass", "text": "a guess"}]}"""


def test_remarks_are_kept_by_kind_with_their_link_or_joint() -> None:
    features = make_features("7")
    overlay = parse_overlay(ANSWER, features)
    assert (overlay.contact_friction, overlay.links[0].appearance) == (0.3, "thin, dull")
    found = model_findings(overlay, features)
    assert [(item.code, item.link, item.joint, item.severity) for item in found] == [
        ("model_note_data", "door", None, Severity.INFO),
        ("model_note_unmet", None, "hinge", Severity.WARNING),
        ("model_note_mass", None, None, Severity.INFO),
        ("model_note_size", None, None, Severity.INFO),
        ("restitution_unused", None, None, Severity.WARNING),
    ]
    assert found[3].message == "scale 0.08: a desk stapler, 15 cm long" and found[4].value == 0.4


def test_every_kind_has_a_code_that_is_explained() -> None:
    from lab.pages.reference import finding_rows

    assert set(CODES.values()) <= {row["code"] for row in finding_rows()}
