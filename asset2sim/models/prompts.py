"""The prompts: a versioned text as the system part, and the object's facts and the user's words as blocks of data; for
a refinement step what is wrong with the joint state."""

import functools
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from asset2sim.models.answers import RefinementAnswer, overlay_schema, trimmed
from asset2sim.models.object_facts import rounded_floats, synthesis_facts
from schemas.features import Features, JointFeatures, RestOverlap
from schemas.interaction import ContactPair
from schemas.model_names import REFINEMENT_PURPOSE
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.request import LabelledImage, ModelRequest
from schemas.vocabulary import Source

SHARED = "shared"
"""The file of sections that several prompts share: what is told of the object, and the conventions of answers."""
SYNTHESIS = "synthesis"
DIRECT = "direct"
IVW = "ivw"
AUTHORED = "authored"
"""The file of the section on numbers that a file in metres states itself, which our method asks about."""

_ESCAPES = str.maketrans({"<": "\\u003c", ">": "\\u003e", "&": "\\u0026"})


def overlay_request(
    purpose: str,
    features: Features,
    guidance: str | None,
    images: Sequence[LabelledImage] = (),
    view: str | None = None,
    overlaps: Sequence[RestOverlap] = (),
) -> ModelRequest:
    """The request for an overlay, of the same facts for every method; ``purpose`` names the prompt, which says which
    terms are wanted. ``view`` names the one view that the question is about, where it is about one."""
    facts = synthesis_facts(features, overlaps)
    information = {"purpose": purpose, **facts, **({} if view is None else {"view": view})}
    text = f"{data_block('structured_information', information)}\n\n{data_block('user_guidance', guidance or '')}"
    disputable = purpose == SYNTHESIS and bool(features.metric)
    return ModelRequest(
        purpose=purpose,
        system=f"{system_text(purpose)}\n\n{_prompt_file(AUTHORED)}" if disputable else system_text(purpose),
        text=text,
        images=tuple(images),
        answer_schema=overlay_schema(purpose, disputable=disputable),
    )


def with_validation_errors(request: ModelRequest, errors: Iterable[str]) -> ModelRequest:
    """The same request, with the last answer's violations as a further block of data."""
    return request.model_copy(update={"text": f"{request.text}\n\n{data_block('validation_errors', list(errors))}"})


def with_consequences(
    request: ModelRequest, answered: object, consequences: Sequence[str], images: Sequence[LabelledImage]
) -> ModelRequest:
    """The same request, with an answer to it and what that comes to as further blocks of data, and pictures of it."""
    blocks = (data_block("your_answer", answered), data_block("consequences", list(consequences)))
    text = "\n\n".join((request.text, *blocks))
    return request.model_copy(update={"text": text, "images": (*request.images, *images)})


def data_block(tag: str, value: object) -> str:
    """A value as compact JSON between tags, which nothing inside it can close. Angle brackets and ampersands are
    written as JSON escapes, so that the block still parses to the same value."""
    text = json.dumps(rounded_floats(value), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    # A lone surrogate, as from a badly decoded file, cannot be encoded.
    return f"<{tag}>\n{text.translate(_ESCAPES).encode('utf-8', 'replace').decode('utf-8')}\n</{tag}>"


@functools.cache
def system_text(purpose: str) -> str:
    """The system part for a purpose, of ``prompt_texts``; a line ``{{Scale}}`` stands for the shared section."""
    return re.sub(r"^\{\{(.+)\}\}$", lambda line: shared_sections()[line[1]], _prompt_file(purpose), flags=re.MULTILINE)


@functools.cache
def shared_sections() -> dict[str, str]:
    """Title → section, with its title, of what the prompts of all methods hold word for word."""
    found = re.findall(r"^(# ([^\n]+)\n.+?)(?=\n+# |\Z)", _prompt_file(SHARED).rstrip(), flags=re.MULTILINE | re.DOTALL)
    return {title: section for section, title in found}


def _prompt_file(name: str) -> str:
    return (Path(__file__).parent / "prompt_texts" / f"{name}.md").read_text(encoding="utf-8")


MAX_PAIRS = 20
"""Overlapping pairs that a prompt lists, worst first."""
SEVERITIES = ((0.02, "severe"), (0.01, "moderate"), (0.002, "small"), (1e-4, "slight"))
"""(Φ above which, m, word): the paper's steps change at 20 and 10 mm, and it approves at 2 mm."""
MM_PER_M = 1e3


@dataclass(frozen=True)
class TriedProposal:
    """An earlier proposal: its joint positions (rad or m), the Φ measured there (m), and whether it was accepted."""

    positions: Mapping[str, float]
    phi_m: float
    accepted: bool = False


@dataclass(frozen=True)
class OverlapPlace:
    """Where two links overlap, in words: on which side of each, and the way in which ``link_a`` leaves ``link_b``.
    ``parted_by`` maps joints to the change of position, rad or m, that about ends the overlap, least of its range
    first."""

    at_a: str
    at_b: str
    a_leaves: str
    parted_by: Mapping[str, float]


@dataclass(frozen=True)
class StateProblem:
    """A joint state to improve: joint name → position in rad, or m at the final scale, its Φ (m) and colliding pairs.
    ``places`` maps pairs of links to where they overlap. ``solved`` are pairs that the last step parted. ``tried`` are
    earlier proposals, oldest first."""

    positions: dict[str, float]
    phi_m: float
    pairs: Sequence[ContactPair] = ()
    tried: Sequence[TriedProposal] = ()
    places: Mapping[tuple[str, str], OverlapPlace] = field(default_factory=dict)
    solved: Sequence[tuple[str, str]] = ()


def refinement_request(
    features: Features,
    overlay: PhysicsOverlay,
    situation: StateProblem,
    focus: Sequence[str],
    reach: Mapping[str, tuple[float, float]],
    images: Sequence[LabelledImage] = (),
    guidance: str | None = None,
) -> ModelRequest:
    """The question for a step of the focus joints (paper, "Refine the state"). ``overlay`` holds the desired state;
    ``reach`` maps each focus joint to the positions between which it may be put; ``guidance`` is the user's words."""
    joints = {joint.name: joint for joint in overlay.joints}
    worst = sorted(situation.pairs, key=lambda pair: -pair.penetration_m)[:MAX_PAIRS]
    labels = {link.name: link.label for link in features.links}
    information: dict[str, object] = {
        "purpose": REFINEMENT_PURPOSE,
        "asset_id": features.asset_id,
        "category": features.category,
        "phi_m": situation.phi_m,
        "severity": severity(situation.phi_m),
        "collisions": [_collision(pair, labels, joints, situation.places) for pair in worst],
        "focus_joints": [_focus_joint(joints[n], features.joint(n), situation, reach[n]) for n in focus],
    }
    if situation.solved:
        information["solved_pairs"] = [list(pair) for pair in situation.solved]
    if situation.tried:
        information["tried"] = [_tried(item, focus) for item in situation.tried]
    return ModelRequest(
        purpose=REFINEMENT_PURPOSE,
        system=system_text(REFINEMENT_PURPOSE),
        text=f"{data_block('structured_information', information)}\n\n{data_block('user_guidance', guidance or '')}",
        images=tuple(images),
        answer_schema=refinement_schema(),
    )


def refinement_schema() -> dict[str, object]:
    """The JSON Schema of the answer; it names no joint, so that it is the same for every asset."""
    schema: dict[str, object] = trimmed(RefinementAnswer.model_json_schema(), frozenset())
    return schema


def severity(phi_m: float) -> str:
    """How bad an overlap of Φ (m) is, in a word and in mm."""
    word = next((word for above, word in SEVERITIES if phi_m > above), "none")
    return f"{word}: {MM_PER_M * phi_m:.3g} mm"


def _collision(
    pair: ContactPair,
    labels: Mapping[str, str],
    joints: Mapping[str, JointPhysics],
    places: Mapping[tuple[str, str], OverlapPlace],
) -> dict[str, object]:
    told: dict[str, object] = {
        "link_a": pair.link_a,
        "link_b": pair.link_b,
        "label_a": labels.get(pair.link_a, ""),
        "label_b": labels.get(pair.link_b, ""),
        "depth_mm": MM_PER_M * pair.depth_m,
        "penetration_m": pair.penetration_m,
    }
    place = places.get((pair.link_a, pair.link_b))
    if place is None:
        return told
    parted = [
        {
            "joint": name,
            "change": change,
            "toward": "open" if change * (joints[name].open - joints[name].closed) >= 0.0 else "closed",
        }
        for name, change in place.parted_by.items()
    ]
    return {**told, "at_a": place.at_a, "at_b": place.at_b, "a_leaves": place.a_leaves, "parted_by": parted}


def _focus_joint(
    joint: JointPhysics, authored: JointFeatures, situation: StateProblem, reach: tuple[float, float]
) -> dict[str, object]:
    return {
        "name": joint.name,
        "type": joint.type,
        "label": joint.label,
        "parent": authored.parent,
        "child": authored.child,
        "position": situation.positions[joint.name],
        "desired": joint.initial_position,
        "asked": joint.position_source is not Source.RULE,
        "lower": joint.lower,
        "upper": joint.upper,
        "closed": joint.closed,
        "open": joint.open,
        "reach": reach,
    }


def _tried(item: TriedProposal, focus: Sequence[str]) -> dict[str, object]:
    told = {name: value for name, value in item.positions.items() if name in focus}
    return {"positions": told, "phi_m": item.phi_m, **({"accepted": True} if item.accepted else {})}
