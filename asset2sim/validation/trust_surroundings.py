"""Belief in where a file in metres has joints start, and in what it says of contacts and collision shapes. Pure."""

from collections.abc import Collection, Iterable
from functools import partial
from statistics import median

from asset2sim.validation.limits import joint_range
from asset2sim.validation.positions import without_whole_turns
from asset2sim.validation.trust import Opinion, doubtful_belief, impossible_belief
from schemas.authored import Belief, kept_share
from schemas.features import Features, JointFeatures, LinkFeatures
from schemas.finding import Notes
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Keep, Quantity, Source, Trust

START_SLACK = 1e-3
"""Share of its range by which a start may lie beyond a limit: rounding."""
SAME_FRICTION = 0.01
"""Share by which coefficients of an object's parts may differ for it to have that coefficient."""
IN_RANGE = Belief(trust=Trust.PLAUSIBLE, reason="it lies within the joint's limits")
OF_SURFACES = Belief(trust=Trust.PLAUSIBLE, reason="as surfaces have")
AS_SEEN = Belief(trust=Trust.PLAUSIBLE, reason="closed, convex, and where its looks are")


def judge_starts(opinion: Opinion, joints: Iterable[JointFeatures], sprung: Collection[str]) -> dict[str, float]:
    """Add how far the stated starts of these joints are believed; those that stay, joint → rad or m at the authored
    scale. ``sprung`` names the joints that a spring brings elsewhere."""
    kept = dict[str, float]()
    for joint in joints:
        if joint.start is not None:
            judge = partial(judged_start, joint, joint.name in sprung)
            opinion.add(Quantity.START, joint.name, judge(joint.start), joint.start, judge)
            if Quantity.START in opinion.kept(joint.name):
                kept[joint.name] = joint.start
    return kept


def judged_start(joint: JointFeatures, sprung: bool, start: float) -> Belief:
    """A start, by its joint's limits and by what moves it at once."""
    if joint.mimic is not None:
        return doubtful_belief("it is where the joint that it follows has it")
    span = joint_range(joint, 1.0, Notes())
    if span is None:
        return doubtful_belief("its limits hold it elsewhere")
    at, slack = without_whole_turns(span, start), START_SLACK * span.span
    if span.lower is not None and span.upper is not None and not span.lower - slack <= at <= span.upper + slack:
        return impossible_belief("it lies outside the joint's limits")
    return doubtful_belief("a spring brings its part elsewhere") if sprung else IN_RANGE


def judge_contact(opinion: Opinion, features: Features, settings: PhysicsSettings) -> tuple[float, Source] | None:
    """Add how far stated coefficients are believed, and give the object's and its source: the median of those of its
    parts, the file's own where all have it; None where none is believed."""
    said = {link.name: link.contact for link in features.links if link.contact is not None}
    stated = {name: contact.friction for name, contact in said.items() if contact.friction is not None}
    enough = {Trust.PLAUSIBLE} | (
        {Trust.DOUBTFUL} if kept_share(opinion.words, Quantity.CONTACT) is Keep.ALL else set()
    )
    usual = {name: value for name, value in stated.items() if judged_friction(settings, value).trust in enough}
    whole = median(usual.values()) if usual else None
    for name, value in stated.items():
        belief = judged_friction(settings, value)
        if name in usual and whole is not None and abs(value - whole) > SAME_FRICTION * whole:
            belief = doubtful_belief(f"an object has one coefficient here, {whole:.3g}, the median of its parts")
        opinion.add(Quantity.CONTACT, name, belief, value, partial(judged_friction, settings))
    for name in said.keys() - stated.keys():
        bounce = said[name].restitution or 0.0
        told = doubtful_belief(f"contacts here do not bounce, and it states a restitution of {bounce:.3g}")
        opinion.add(
            Quantity.CONTACT, name, told if 0.0 <= bounce <= 1.0 else impossible_belief("no contact gains energy")
        )
    if whole is None or not any((Quantity.CONTACT, name) in opinion.found for name in usual):
        return None
    same = all(Quantity.CONTACT in opinion.kept(name) for name in usual)
    return whole, Source.AUTHORED if same else Source.RULE


def judged_friction(settings: PhysicsSettings, value: float) -> Belief:
    """A Coulomb coefficient, by those of known pairs of surfaces."""
    if value < 0.0:
        return impossible_belief("friction would push")
    low, high = settings.least_contact_friction, settings.most_contact_friction
    return OF_SURFACES if low <= value <= high else doubtful_belief(f"not {low:g} to {high:g}, {OF_SURFACES.reason}")


def judge_shapes(opinion: Opinion, links: Iterable[LinkFeatures]) -> None:
    """Add how far collision shapes are believed, of the links that have any."""
    for link in links:
        if link.has_shapes:
            opinion.add(
                Quantity.SHAPES, link.name, doubtful_belief(link.shapes_doubt) if link.shapes_doubt else AS_SEEN
            )
