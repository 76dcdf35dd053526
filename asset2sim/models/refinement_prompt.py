"""The request for a refinement step: what is wrong with the joint state, in numbers, as one block of data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from asset2sim.models.answers import RefinementAnswer, trimmed
from asset2sim.models.prompts import data_block, system_text
from schemas.features import Features, JointFeatures
from schemas.measurement import ContactPair
from schemas.model_names import REFINEMENT_PURPOSE
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.request import LabelledImage, ModelRequest

MAX_PAIRS = 20
"""Overlapping pairs that a prompt lists, worst first."""

Problem = Literal["overlap", "moved", "fell"]
"""Why a model is asked: parts overlap in every state near the desired one, the search had to leave the desired state,
or joints that must stay where they are put do not."""


@dataclass(frozen=True)
class RefusedProposal:
    """A refused proposal: its joint positions (rad or m), the Φ measured there (m), and where the joints settled, if
    the problem is that they moved by themselves."""

    positions: Mapping[str, float]
    phi_m: float
    settled: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class StateProblem:
    """A joint state to improve: joint name → position in rad, or m at the final scale, its Φ (m) and colliding pairs.
    ``settled`` maps joints to where they settled untouched, for the problem "fell". ``desired_phi_m`` is Φ in the
    desired state, for the problem "moved"."""

    problem: Problem
    positions: dict[str, float]
    phi_m: float
    pairs: Sequence[ContactPair] = ()
    settled: Mapping[str, float] = field(default_factory=dict)
    desired_phi_m: float | None = None
    tried: Sequence[RefusedProposal] = ()


def refinement_request(
    features: Features,
    overlay: PhysicsOverlay,
    situation: StateProblem,
    focus: Sequence[str],
    reach: Mapping[str, tuple[float, float]],
    images: Sequence[LabelledImage] = (),
) -> ModelRequest:
    """The question for a step of the focus joints (paper, "Refine the state"). ``overlay`` holds the desired state;
    ``reach`` maps each focus joint to the positions between which it may be put."""
    joints = {joint.name: joint for joint in overlay.joints}
    worst = sorted(situation.pairs, key=lambda pair: -pair.penetration_m)[:MAX_PAIRS]
    information: dict[str, object] = {
        "purpose": REFINEMENT_PURPOSE,
        "asset_id": features.asset_id,
        "category": features.category,
        "problem": situation.problem,
        "phi_m": situation.phi_m,
        "pairs": [{"link_a": p.link_a, "link_b": p.link_b, "penetration_m": p.penetration_m} for p in worst],
        "focus_joints": [_focus_joint(joints[n], features.joint(n), situation, reach[n]) for n in focus],
    }
    if situation.desired_phi_m is not None:
        information["desired_phi_m"] = situation.desired_phi_m
    if situation.tried:
        information["tried"] = [_tried(item, focus) for item in situation.tried]
    return ModelRequest(
        purpose=REFINEMENT_PURPOSE,
        system=system_text(REFINEMENT_PURPOSE),
        text=data_block("structured_information", information),
        images=tuple(images),
        answer_schema=refinement_schema(),
    )


def refinement_schema() -> dict[str, object]:
    """The JSON Schema of the answer; it names no joint, so that it is the same for every asset."""
    schema: dict[str, object] = trimmed(RefinementAnswer.model_json_schema(), frozenset())
    return schema


def _focus_joint(
    joint: JointPhysics, authored: JointFeatures, situation: StateProblem, reach: tuple[float, float]
) -> dict[str, object]:
    settled = {"settled": situation.settled[joint.name]} if joint.name in situation.settled else {}
    return {
        "name": joint.name,
        "type": joint.type,
        "label": joint.label,
        "parent": authored.parent,
        "child": authored.child,
        "position": situation.positions[joint.name],
        "desired": joint.initial_position,
        **settled,
        "lower": joint.lower,
        "upper": joint.upper,
        "closed": joint.closed,
        "open": joint.open,
        "reach": reach,
    }


def _tried(item: RefusedProposal, focus: Sequence[str]) -> dict[str, object]:
    told: dict[str, object] = {
        "positions": {name: value for name, value in item.positions.items() if name in focus},
        "phi_m": item.phi_m,
    }
    return {**told, "settled": dict(item.settled)} if item.settled else told
