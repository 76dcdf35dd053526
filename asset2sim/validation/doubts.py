"""Doubts about an answer (size, state, what falls shut), measured, as sentences for the model that gave it.
Rules do not change these values.

The expectation is ``prior/household``'s. It is told without its numbers, so that a model decides by what it sees; what
counts as far from it is the model's own σ.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from asset2sim.assets.extract import Extraction
from asset2sim.guidance import tables
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.sizing import dimension, propose_scale
from asset2sim.guidance.supports import usual_support
from asset2sim.models.object_facts import rounded_object_info
from asset2sim.validation.asked_state import RequestedState, requested_states, share_of
from asset2sim.validation.holding import HELD_STATE
from asset2sim.validation.size import STATED_SHARE, size_bounds
from asset2sim.validation.validate import contact_friction, validate
from schemas.errors import AssetError
from schemas.features import Features
from schemas.guidance import Guidance
from schemas.overlay import JointPhysics, Overlay, PhysicsOverlay
from schemas.settings import DoubtSettings, Settings
from schemas.support import Support
from schemas.vocabulary import Source

SCALE = "scale"
UNKNOWN = "*"
"""Category of an object of which the tables know nothing: any size that a household has will do."""


@dataclass(frozen=True)
class Doubt:
    """One thing of an answer that is doubtful, ``scale`` or a joint, and the ``consequence`` in words."""

    what: str
    consequence: str


@dataclass(frozen=True)
class AnswerOutcome:
    """Consequences of an answer: its doubts, where its joints start and where gravity leaves them, rad or m at the
    authored scale; no places where the answer makes no object."""

    doubts: tuple[Doubt, ...]
    starts: Mapping[str, float] = field(default_factory=dict)
    ends: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class ObjectQuestion:
    """Subject of a question to a model: the object, what the user's words ask of it, whose answers these are, what
    carries the object if that is stated, and which of ``scale`` and the joints the user states as numbers."""

    extraction: Extraction
    guidance: Guidance
    source: Source
    settings: Settings
    support: Support | None = None
    stated: Collection[str] = ()


def consequences(question: ObjectQuestion, answer: Overlay) -> AnswerOutcome:
    """The consequences of an answer, its units corrected, with every doubt of it."""
    features, settings = question.extraction.features, question.settings
    info = rounded_object_info(features)
    made = completed_physics(question, answer)
    found = size_doubts(info, question.guidance, answer, features, made, settings.doubt)
    wanted = requested_states(info, question.guidance, answer.scale, settings.physics)
    found += [doubt for want in wanted.values() for doubt in state_doubts(want, answer, features, settings.doubt)]
    starts, ends = dict(answer.initial_joint_positions), dict[str, float]()
    if made is not None:
        units = {joint.name: made.scale if joint.prismatic else 1.0 for joint in features.joints}
        starts = {name: at / units[name] for name, at in made.initial_positions.items()}
        share = settings.search.state_tolerance
        falls = {joint.name: end for joint in made.joints if (end := where_gravity_takes(joint, share)) is not None}
        found += [fall_doubt(joint, falls[joint.name], features) for joint in made.joints if joint.name in falls]
        ends = {name: at / units[name] for name, at in falls.items()}
    return AnswerOutcome(tuple(doubt for doubt in found if doubt.what not in question.stated), starts, ends)


def completed_physics(question: ObjectQuestion, answer: Overlay) -> PhysicsOverlay | None:
    """The physics that rules make of an answer; None where they cannot."""
    physics = question.settings.physics
    friction = contact_friction(answer.contact_material, physics)
    try:
        return validate(
            question.extraction,
            answer,
            question.source,
            friction,
            physics,
            question.support,
            guidance=question.guidance,
        )[0]
    except AssetError:  # the stage that does this for good says why
        return None


def size_doubts(
    info: ObjectInfo,
    guidance: Guidance,
    answer: Overlay,
    features: Features,
    made: PhysicsOverlay | None,
    settings: DoubtSettings,
) -> list[Doubt]:
    """The doubt of the scale, where it is further from the one expected than σ."""
    size = tables.sizes()[guidance.category]
    authored = dimension(info, size)
    if authored <= 0.0:
        return []
    bounds = size_bounds(info, size, guidance.size)
    carried = guidance.support or usual_support(info, guidance.called, guidance.category)
    usual = propose_scale(info, size, guidance.size, carried).value
    if size.category == UNKNOWN and bounds.exact is None:
        usual = min(max(answer.scale, bounds.low_m / authored), bounds.high_m / authored)
    sigma = scale_sigma(answer, settings) if bounds.exact is None else STATED_SHARE
    if abs(math.log(answer.scale) - math.log(usual)) <= sigma:
        return []
    edges = " × ".join(f"{100.0 * answer.scale * edge:.3g}" for edge in features.closed_size)
    weighs = "" if made is None else f", {made.mass_kg:.3g} kg"
    seems = "small" if answer.scale < usual else "large"
    why = f"{seems} for such a thing, asked for in these words"
    why = why if bounds.exact is None else "not to be the size that the user's words state"
    told = (
        f"scale {answer.scale:.4g} ({_sigma(answer, SCALE)}) makes the closed object {edges} cm (x, y, z; z is up)"
        f"{weighs}: that seems {why}"
    )
    return [Doubt(SCALE, told)]


def state_doubts(want: RequestedState, answer: Overlay, features: Features, settings: DoubtSettings) -> list[Doubt]:
    """The doubt of one joint's position, where the words seem to ask for one that is further off than σ."""
    name, at = want.joint.name, answer.initial_joint_positions.get(want.joint.name)
    called = part_name(name, features)
    if at is None:
        if not want.by_name:
            return []
        told = (
            f"the user's words seem to ask that {called} is {want.words}, and the answer gives it no position: it "
            "starts closed"
        )
        return [Doubt(name, told)]
    near = abs(at - want.position) <= position_sigma(answer, name, want.travel, settings)
    if near or want.met_by(share_of(want.joint, at)):
        return []
    turned = f", {math.degrees(abs(at - want.joint.closed)):.0f}°"
    told = (
        f"{called} at {at:.4g} ({_sigma(answer, name)}) is {share_of(want.joint, at):.0%} of its travel from closed"
        f"{'' if want.joint.motion == 'slider' else turned}, where the user's words seem to ask: {want.words}"
    )
    return [Doubt(name, told)]


def where_gravity_takes(joint: JointPhysics, share: float) -> float | None:
    """Where gravity takes a joint that is asked to stand somewhere, by more than this share of how far it is open (of
    its range where it is closed), rad or m at the final scale; None where it stays."""
    if joint.asked_position is None or joint.mimic is not None or joint.lower is None or joint.upper is None:
        return None
    at, span = joint.initial_position, joint.upper - joint.lower
    force = joint.gravity_load + joint.exerted(at)
    if abs(force) <= joint.friction:
        return None
    end = joint.upper if force > 0.0 else joint.lower
    if joint.stiffness > 0.0:
        moved = math.copysign((abs(force) - joint.friction) / joint.stiffness, force)
        end = min(max(at + moved, joint.lower), joint.upper)
    opened = abs(at - joint.closed)
    return end if abs(end - at) > share * (opened if opened > HELD_STATE * span else span) else None


def fall_doubt(joint: JointPhysics, end: float, features: Features) -> Doubt:
    """The doubt of a position that does not last, with where the part goes (rad or m at the final scale)."""
    towards = "shut" if abs(end - joint.closed) < abs(end - joint.open) else "open"
    held = "its spring is too weak" if joint.stiffness > 0.0 else "the answer says that it does not hold"
    told = (
        f"gravity moves {part_name(joint.name, features)} from where the answer puts it, {joint.initial_position:.4g}, "
        f"{towards} to {end:.4g}: {held}"
    )
    return Doubt(joint.name, told)


def scale_sigma(answer: Overlay, settings: DoubtSettings) -> float:
    """Relative σ of the difference of the answer's scale and the expected one."""
    return math.hypot(answer.uncertainty.get(SCALE, settings.scale_sigma), settings.prior_scale_sigma)


def position_sigma(answer: Overlay, joint: str, travel: float, settings: DoubtSettings) -> float:
    """σ of the difference of a joint's position and the expected one, in the unit of its useful ``travel``."""
    stated = answer.uncertainty.get(joint, settings.position_sigma * travel)
    return math.hypot(stated, settings.prior_position_sigma * travel)


def part_name(joint: str, features: Features) -> str:
    """A joint with the label of what it moves: "joint_2 (lid)"."""
    label = features.link(features.joint(joint).child).label
    return f"{joint} ({label.replace('_', ' ')})" if label else joint


def _sigma(answer: Overlay, what: str) -> str:
    sigma = answer.uncertainty.get(what)
    if sigma is None:
        return "σ not stated"
    return f"σ {sigma:.0%}" if what == SCALE else f"σ {sigma:.3g}"
