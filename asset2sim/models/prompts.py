"""The prompts: a versioned text as the system part, and the object's facts and the user's words as blocks of data."""

import functools
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from asset2sim.models.answers import overlay_schema
from schemas.base import Vector3
from schemas.features import Features, JointFeatures, LinkFeatures
from schemas.request import LabelledImage, ModelRequest

SYNTHESIS = "synthesis"
DIRECT = "direct"
IVW = "ivw"
REFINEMENT = "refinement"
SIGNIFICANT_DIGITS = 5
"""Digits kept of every number in a prompt: beyond what a model can use, and a third of the tokens of a double."""

_ESCAPES = str.maketrans({"<": "\\u003c", ">": "\\u003e", "&": "\\u0026"})


def synthesis_request(
    features: Features,
    guidance: str | None,
    closed_size: Vector3,
    link_centers: Mapping[str, Vector3],
    images: Sequence[LabelledImage] = (),
) -> ModelRequest:
    """The request for an overlay by our method; see ``overlay_request``."""
    return overlay_request(SYNTHESIS, features, guidance, closed_size, link_centers, images)


def overlay_request(
    purpose: str,
    features: Features,
    guidance: str | None,
    closed_size: Vector3,
    link_centers: Mapping[str, Vector3],
    images: Sequence[LabelledImage] = (),
    view: str | None = None,
) -> ModelRequest:
    """The request for an overlay; ``purpose`` names the prompt, which says which terms are wanted.

    ``closed_size`` is the object's box with every joint closed, m at scale 1. ``link_centers`` maps link names to the
    centre of the link's shape in the root link's frame at rest, m; a link that it lacks is stated without a centre.
    ``view`` names the one view that the question is about, where it is about one.
    """
    information = {
        "purpose": purpose,
        "asset_id": features.asset_id,
        "category": features.category,
        "size_m": features.rest_size,
        "size_closed_m": closed_size,
        "links": [_link(link, link_centers.get(link.name)) for link in features.links],
        "joints": [_joint(joint) for joint in features.joints],
        **({} if view is None else {"view": view}),
    }
    text = f"{data_block('structured_information', information)}\n\n{data_block('user_guidance', guidance or '')}"
    return ModelRequest(
        purpose=purpose,
        system=system_text(purpose),
        text=text,
        images=tuple(images),
        answer_schema=overlay_schema(purpose),
    )


def with_validation_errors(request: ModelRequest, errors: Iterable[str]) -> ModelRequest:
    """The same request, with the last answer's violations as a further block of data."""
    return request.model_copy(update={"text": f"{request.text}\n\n{data_block('validation_errors', list(errors))}"})


def data_block(tag: str, value: object) -> str:
    """A value as compact JSON between tags, which nothing inside it can close.

    Angle brackets and ampersands are written as JSON escapes, so that the block still parses to the same value.
    """
    text = json.dumps(rounded(value), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    # A lone surrogate, as from a badly decoded file, cannot be encoded.
    return f"<{tag}>\n{text.translate(_ESCAPES).encode('utf-8', 'replace').decode('utf-8')}\n</{tag}>"


@functools.cache
def system_text(purpose: str) -> str:
    """The system part for a purpose, from its file in ``prompts``."""
    return (Path(__file__).parent / "prompts" / f"{purpose}.md").read_text(encoding="utf-8")


def _link(link: LinkFeatures, center: Vector3 | None) -> dict[str, object]:
    return {
        "name": link.name,
        "label": link.label,
        "joint_kind": link.joint_kind,
        "box_m": link.box_size,
        "center_m": center,
        "volume_m3": link.volume_m3,
        "hull_volume_m3": link.hull_volume_m3,
        "volume_source": link.volume_source.value,
        "area_m2": link.area_m2,
        "materials": link.materials,
        "mass_kg": None if link.inertial is None else link.inertial.mass_kg,
    }


def _joint(joint: JointFeatures) -> dict[str, object]:
    limits = [limit for limit in (joint.lower, joint.upper) if limit is not None]
    return {
        "name": joint.name,
        "type": joint.type,
        "parent": joint.parent,
        "child": joint.child,
        "axis": joint.axis_in_root,
        # Validation swaps inverted limits; a model is told the range that it will have.
        "lower": min(limits, default=None),
        "upper": max(limits, default=None),
        "closed": joint.closed,
        "open": joint.open,
        "open_confidence": joint.openness_confidence,
    }


def rounded(value: object, digits: int = SIGNIFICANT_DIGITS) -> object:
    """The value with every float in it rounded to this many significant digits."""
    if isinstance(value, float):
        return float(f"{value:.{digits}g}") + 0.0  # and no negative zero
    if isinstance(value, Mapping):
        return {key: rounded(item, digits) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(item, digits) for item in value]
    return value
