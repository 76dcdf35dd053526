"""A model's remarks on its answer, as findings of the asset."""

from schemas.features import Features
from schemas.finding import Finding, remark, warning
from schemas.overlay import NoteKind, Overlay
from schemas.vocabulary import Stage

CODES: dict[NoteKind, str] = {
    "size": "model_note_size", "mass": "model_note_mass", "motion": "model_note_motion", "state": "model_note_state",
    "support": "model_note_support", "data": "model_note_data", "unmet": "model_note_unmet",
}  # fmt: skip
"""Kind of a model's remark → code of its finding."""


def model_findings(overlay: Overlay, features: Features) -> tuple[Finding, ...]:
    """A finding for each of the model's remarks, a warning where it cannot do what the user asked or could not tell it,
    and one for a restitution, for which a URDF has no place."""
    links, joints = ({item.name for item in items} for items in (features.links, features.joints))

    def where(about: str | None) -> dict[str, str | None]:
        return {"link": about if about in links else None, "joint": about if about in joints else None}

    found = list[Finding]()
    for note in overlay.findings:
        say, text = (
            warning if note.kind == "unmet" else remark,
            f"{note.about}: {note.text}" if note.about else note.text,
        )
        found.append(say(Stage.SYNTHESIZE, CODES[note.kind], text, **where(note.about)))
    for item in overlay.unclear:
        text = f"the model could not tell {item.about}: {item.why}"
        found.append(warning(Stage.SYNTHESIZE, "model_unclear", text, **where(item.about)))
    if overlay.size_reason:
        message = f"scale {overlay.scale:.4g}: {overlay.size_reason}"
        found.append(remark(Stage.SYNTHESIZE, "model_note_size", message))
    if overlay.restitution is not None:
        message = (
            f"a restitution of {overlay.restitution:.3g} is stated; a URDF has no place for it, and contacts here do "
            "not bounce: set it in your engine"
        )
        found.append(warning(Stage.SYNTHESIZE, "restitution_unused", message, value=overlay.restitution))
    return tuple(found)
