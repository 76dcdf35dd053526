"""Belief in what a file in metres says of its joints, by what hands do with parts and by whether one number stands for
parts that differ, and the keeping of what is believed. Pure."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from asset2sim.assets.urdf.read import Dynamics
from asset2sim.physics.arrays import Array
from asset2sim.physics.dynamics import WEAKEST_HZ
from asset2sim.physics.mass_matrix import Pull
from asset2sim.validation.disputes import Disputes, Judge
from asset2sim.validation.handling import Handling, as_strong_as_stated
from asset2sim.validation.holding import felt_friction
from schemas.authored import Authored, Belief, kept_share
from schemas.features import Features
from schemas.finding import Finding
from schemas.overlay import JointPhysics, JointProposal, Overlay, PhysicsOverlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Keep, Quantity, Source, Trust

TERMS: Mapping[Quantity, str] = {
    Quantity.DAMPING: "damping",
    Quantity.FRICTION: "friction",
    Quantity.SPRINGS: "stiffness",
}
"""Quantity of a joint's dynamics → its field."""
QUARTER_TURN, FREE_SLIDE_M = math.pi / 2.0, 0.3
"""Range of a joint without limits, rad or m, that a hand takes it through."""
SPRING_PLACES = 9
"""Positions along its range at which a spring's effort is taken beside the weight that it carries."""
NO_PULL = Pull(0.0, 0.0)
PLAUSIBLE_TERM = Belief(trust=Trust.PLAUSIBLE, reason="a hand moves such a part so")


def impossible_belief(reason: str) -> Belief:
    """The belief that a number is impossible: no body has it."""
    return Belief(trust=Trust.IMPOSSIBLE, reason=reason)


def doubtful_belief(reason: str) -> Belief:
    """The belief that a number is doubtful: such a part does not have it."""
    return Belief(trust=Trust.DOUBTFUL, reason=reason)


@dataclass
class Opinion:
    """How far each of an object's stated numbers is believed, by (quantity, link or joint). Those are judged that the
    ``words`` of ``--keep`` name, and of an object that stays ``in_metres`` all where they say plausible."""

    words: tuple[str, ...]
    in_metres: bool
    disputes: Disputes
    found: dict[tuple[Quantity, str], Belief] = field(default_factory=dict)

    @property
    def on_joints(self) -> bool:
        """Whether any term of a joint's dynamics may be kept."""
        return self.in_metres or any(kept_share(self.words, quantity) is Keep.ALL for quantity in TERMS)

    def keeps(self, quantity: Quantity) -> bool:
        """Whether a quantity's plausible numbers are to stay."""
        keep = kept_share(self.words, quantity)
        return keep is Keep.ALL or (keep is Keep.PLAUSIBLE and self.in_metres)

    def add(
        self, quantity: Quantity, name: str, belief: Belief, stated: float | None = None, judge: Judge | None = None
    ) -> Belief:
        """Add what is believed of one number, unless it is not to be kept; a doubtful one that is to be stays. A model
        may dispute a ``stated`` number with another, which ``judge`` judges."""
        keep, judged = kept_share(self.words, quantity), self.keeps(quantity)
        if stated is not None and judge is not None and judged:
            belief = self.disputes.settle(quantity, name, stated, belief, judge, keep)
        if keep is Keep.ALL and belief.trust is Trust.DOUBTFUL:
            belief = Belief(trust=Trust.PLAUSIBLE, reason=f"kept as asked, though {belief.reason}")
        if judged:
            self.found[quantity, name] = belief
        return belief

    def kept(self, name: str) -> frozenset[Quantity]:
        """The quantities of a link or joint that are kept as its file has them."""
        return frozenset(q for (q, of), judged in self.found.items() if of == name and judged.trust is Trust.PLAUSIBLE)

    def grouped(self) -> tuple[Authored, ...]:
        """All that is stated, numbers that are judged alike together."""
        groups: dict[tuple[Quantity, Belief], list[str]] = {}
        for (quantity, name), judged in self.found.items():
            if judged.trust is not Trust.ABSENT:
                groups.setdefault((quantity, judged), []).append(name)
        order = list(Quantity)
        return tuple(
            Authored(trust=judged.trust, reason=judged.reason, quantity=quantity, of=tuple(filter(None, names)))
            for (quantity, judged), names in sorted(groups.items(), key=lambda item: order.index(item[0][0]))
        )


def judge_joints(
    opinion: Opinion,
    joints: Iterable[JointPhysics],
    stated: Mapping[str, Dynamics],
    handled: Mapping[str, Handling],
    pulls: Mapping[str, Pull],
    settings: PhysicsSettings,
) -> None:
    """Add how far the damping, friction and springs of an object in metres are believed, its ``joints`` being as they
    would be without them: inertia, range, load. ``pulls`` are gravity's on those with springs."""
    every = list(joints)
    for quantity, term in TERMS.items():
        alike = shared_by_unlike(every, {name: float(getattr(own, term)) for name, own in stated.items()}, settings)
        for joint in every:
            own = stated[joint.name]
            value = float(getattr(own, term))
            if value == 0.0:
                continue
            pull = pulls.get(joint.name, NO_PULL)
            judge = partial(judged_value, quantity, own, joint, handled[joint.name], pull, settings)
            shared = joint.name in alike and value > 0.0
            belief = doubtful_belief("joints that move far more and far less have the same") if shared else judge(value)
            opinion.add(quantity, joint.name, belief, value, judge)


def shared_by_unlike(
    joints: Sequence[JointPhysics], values: Mapping[str, float], settings: PhysicsSettings
) -> frozenset[str]:
    """The joints whose value is that of others too, though these slide where it turns, or move far more or less."""
    groups: dict[float, list[JointPhysics]] = {}
    for joint in joints:
        groups.setdefault(values[joint.name], []).append(joint)
    unlike = set[str]()
    for group in groups.values():
        moved = [joint.effective_inertia for joint in group]
        kinds = {joint.type == "prismatic" for joint in group}
        if len(kinds) > 1 or max(moved) > settings.alike_inertia * min(moved):
            unlike.update(joint.name for joint in group)
    return frozenset(unlike)


def judged_value(
    quantity: Quantity,
    stated: Dynamics,
    joint: JointPhysics,
    kind: Handling,
    pull: Pull,
    settings: PhysicsSettings,
    value: float,
) -> Belief:
    """Belief in a value of one term of a joint, beside the others that are stated."""
    if value < 0.0:
        return impossible_belief("it would feed the motion instead of braking it")
    changed: dict[str, Any] = {TERMS[quantity]: value}
    return judged_term(quantity, replace(stated, **changed), joint, kind, pull, settings)


def judged_term(
    quantity: Quantity, stated: Dynamics, joint: JointPhysics, kind: Handling, pull: Pull, settings: PhysicsSettings
) -> Belief:
    """Belief in one stated term of a joint, by what a hand needs for it at the part's edge, of a spring beside the
    weight that it carries (``pull``), and by whether it does anything."""
    slides = joint.type == "prismatic"
    span = FREE_SLIDE_M if slides else QUARTER_TURN
    if joint.lower is not None and joint.upper is not None:
        span = joint.upper - joint.lower
    inertia, most_n = joint.effective_inertia, kind.range.most_n
    if quantity is Quantity.DAMPING:
        effort = stated.damping * span / settings.hand_opens_s
        if inertia > settings.longest_coast_s * stated.damping:
            return doubtful_belief(f"its part would coast for more than {settings.longest_coast_s:g} s")
    elif quantity is Quantity.FRICTION:
        effort = stated.friction
    else:
        ends = ends_of(joint)
        alone = stated.stiffness * max(abs(end - stated.spring_reference) for end in ends)
        effort = most_left(stated, joint, pull)
        if stated.stiffness <= (2.0 * math.pi * WEAKEST_HZ) ** 2 * inertia:
            return doubtful_belief("it would take half a minute to bring its part back")
        least_n = kind.range.least_n / settings.stated_spring_factor
        most_n *= settings.stated_spring_factor
        if alone < kind.lever * least_n:
            return doubtful_belief(f"weaker than a {kind.range.kind} feels, {least_n:g} N")
    if effort > kind.lever * most_n:
        return doubtful_belief(f"a hand would need more than a {kind.range.kind} takes, {most_n:g} N")
    return PLAUSIBLE_TERM


def ends_of(joint: JointPhysics) -> list[float]:
    """The ends of a joint's range, rad or m; where it has none, what a hand takes it to."""
    ends = [end for end in (joint.lower, joint.upper) if end is not None]
    return ends or [joint.initial_position + (FREE_SLIDE_M if joint.type == "prismatic" else QUARTER_TURN)]


def most_left(stated: Dynamics, joint: JointPhysics, pull: Pull) -> float:
    """The most that gravity and a stated spring together do to a joint within its range, N·m or N."""
    ends = ends_of(joint)
    places = np.linspace(min(ends), max(ends), SPRING_PLACES)
    return float(np.abs(left_by_spring(stated, pull, places)).max())


def left_by_spring(stated: Dynamics, pull: Pull, places: Array) -> Array:
    """(n,) what gravity and a stated spring together do to a joint at these positions (rad or m), N·m or N."""
    left: Array = pull.at(places) + stated.stiffness * (stated.spring_reference - places)
    return left


def carried_where_they_start(
    opinion: Opinion, features: Features, stated: Mapping[str, Dynamics], pulls: Mapping[str, Pull]
) -> frozenset[str]:
    """The joints whose stated spring and friction, both believed, carry their part's weight where the file has them
    start: they stay there."""
    found = set[str]()
    for joint in features.movable_joints:
        own = stated[joint.name]
        if joint.start is None or not {Quantity.SPRINGS, Quantity.FRICTION} <= opinion.kept(joint.name):
            continue
        if abs(float(left_by_spring(own, pulls[joint.name], np.array([joint.start]))[0])) <= own.friction:
            found.add(joint.name)
    return frozenset(found)


def with_kept_terms(
    overlay: Overlay,
    opinion: Opinion,
    stated: Mapping[str, Dynamics],
    joints: Iterable[JointPhysics],
    handled: Mapping[str, Handling],
    carried: Collection[str] = (),
) -> Overlay:
    """The proposal with the believed dynamics of the file in place of its own, but where its user states them; a part
    with a spring rests where that, its weight and the ground leave it, and one that it has ``carried`` where it starts.
    ``joints`` are as they would be without."""
    proposals = {proposal.name: proposal for proposal in overlay.joints}
    for joint in joints:
        kept, own = opinion.kept(joint.name), stated[joint.name]
        if f"{joint.name}.dynamics" in overlay.asked:
            continue
        if joint.position_source is Source.USER:
            kept -= {Quantity.SPRINGS}
        terms = {TERMS[quantity]: float(getattr(own, TERMS[quantity])) for quantity in TERMS if quantity in kept}
        if not terms:
            continue
        update: dict[str, object] = dict(terms)
        if Quantity.SPRINGS in kept:
            rest = own.spring_reference + (joint.gravity_load + handled[joint.name].ground_load) / own.stiffness
            rest = rest if joint.lower is None else max(rest, joint.lower)
            update |= dict.fromkeys(("spring_hz", "returns_s", "press_start", "press_end"))
            rest = rest if joint.upper is None else min(rest, joint.upper)
            update |= {"holds": True} if joint.name in carried else {"spring_rest": rest, "holds": False}
        before = proposals.get(joint.name) or JointProposal(name=joint.name)
        proposals[joint.name] = before.model_copy(update=update)
    return overlay.model_copy(update={"joints": tuple(proposals.values())})


def with_limits(opinion: Opinion, done: PhysicsOverlay, metric: str) -> Opinion:
    """The opinion with that of the size, by the reason that it is ``metric``, and of joints' limits: those that no rule
    had to change are believed."""
    if metric:
        opinion.found[Quantity.SIZE, ""] = Belief(trust=Trust.PLAUSIBLE, reason=metric)
    for joint in done.all_joints:
        if joint.lower is not None and joint.limits_source is not Source.USER:
            kept = joint.limits_source is Source.AUTHORED
            judged = Belief(trust=Trust.PLAUSIBLE, reason="a range, with zero in it or its start stated beside")
            told = impossible_belief("no range, or one in other turns than a joint's zero")
            opinion.add(Quantity.LIMITS, joint.name, judged if kept else told)
    return opinion


def with_authored_sources(
    done: PhysicsOverlay,
    opinion: Opinion,
    stated: Mapping[str, Dynamics],
    handled: Mapping[str, Handling],
    pulls: Mapping[str, Pull],
    settings: PhysicsSettings,
) -> PhysicsOverlay:
    """The overlay with the source ``authored`` beside each believed term of a joint that no rule changed, and a kept
    spring relaxed where its file has it; its part may take what that gives beside gravity's ``pulls``. Friction that
    holds its part, and that a hand feels, is not raised for what else may bump it: the checks say whether that is
    needed."""

    def sourced(joint: JointPhysics) -> JointPhysics:
        update: dict[str, object] = {}
        for quantity in opinion.kept(joint.name) & TERMS.keys():
            term, value = TERMS[quantity], float(getattr(stated[joint.name], TERMS[quantity]))
            if getattr(joint, f"{term}_source") is Source.USER:
                continue
            load = abs(joint.gravity_load + joint.stiffness * (joint.spring_reference - joint.initial_position))
            least = max(settings.least_hold_margin * load * joint.holds, felt_friction(handled[joint.name], load))
            enough = quantity is Quantity.FRICTION and least <= value < joint.friction
            if enough or math.isclose(getattr(joint, term), value, rel_tol=1e-9):
                update |= {term: value, f"{term}_source": Source.AUTHORED}
                if quantity is Quantity.SPRINGS:
                    update["spring_reference"] = stated[joint.name].spring_reference
                    takes_n = most_left(stated[joint.name], joint, pulls[joint.name]) / handled[joint.name].lever
                    update["effort_range"] = as_strong_as_stated(joint.effort_range, takes_n)
        return joint.model_copy(update=update)

    kinds = {kind: tuple(map(sourced, getattr(done, kind))) for kind in ("joints", "followers")}
    return done.model_copy(update=kinds)


def without_bounds_of(done: PhysicsOverlay, findings: Sequence[Finding]) -> list[Finding]:
    """The findings without those on friction that was to be raised and stays as its file has it."""
    kept = {joint.name for joint in done.all_joints if joint.friction_source is Source.AUTHORED}
    return [item for item in findings if item.code != "friction_bounded" or item.joint not in kept]
