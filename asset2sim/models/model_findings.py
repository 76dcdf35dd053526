"""A model's remarks on its answer, as findings of the asset."""

from schemas.features import Features
from schemas.finding import Finding
from schemas.overlay import NoteKind, Overlay
from schemas.vocabulary import Severity, Stage

CODES: dict[NoteKind, str] = {
    "size": "model_note_size", "mass": "model_note_mass", "motion": "model_note_motion", "state": "model_note_state",
    "support": "model_note_support", "data": "model_note_data", "unmet": "model_note_unmet",
}  # fmt: skip
"""Kind of a model's remark → code of its finding."""


def model_findings(overlay: Overlay, features: Features) -> tuple[Finding, ...]:
    """A finding for each of the model's remarks, a warning where it cannot do what the user asked or could not tell it,
    and one for a restitution, for which a URDF has no place."""
    links, joints = ({item.name for item in items} for items in (features.links, features.joints))
    found = [
        Finding(
            stage=Stage.SYNTHESIZE,
            severity=Severity.WARNING if note.kind == "unmet" else Severity.INFO,
            code=CODES[note.kind],
            message=f"{note.about}: {note.text}" if note.about else note.text,
            link=note.about if note.about in links else None,
            joint=note.about if note.about in joints else None,
        )
        for note in overlay.findings
    ]
    found += [
        Finding(
            stage=Stage.SYNTHESIZE,
            severity=Severity.WARNING,
            code="model_unclear",
            message=f"the model could not tell {item.about}: {item.why}",
            link=item.about if item.about in links else None,
            joint=item.about if item.about in joints else None,
        )
        for item in overlay.unclear
    ]
    if overlay.size_reason:
        message = f"scale {overlay.scale:.4g}: {overlay.size_reason}"
        found.append(Finding(stage=Stage.SYNTHESIZE, severity=Severity.INFO, code="model_note_size", message=message))
    if overlay.restitution is not None:
        message = (
            f"a restitution of {overlay.restitution:.3g} is stated; a URDF has no place for it, and contacts here do "
            "not bounce: set it in your engine"
        )
        found.append(
            Finding(
                stage=Stage.SYNTHESIZE,
                severity=Severity.WARNING,
                code="restitution_unused",
                message=message,
                value=overlay.restitution,
            )
        )
    return tuple(found)
