"""Forces that a hand may need at each part: the range of forces for its kind, and what the object bears before it
tips."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from asset2sim.guidance.parts import by_shape, held_as, part_name, shape_name, swinging
from asset2sim.guidance.tables import mechanism, part_effort, turns_as_its_kind
from asset2sim.physics.arrays import Array
from asset2sim.physics.felt import press_forces
from asset2sim.physics.grip import Grip, grip_on, round_about
from asset2sim.physics.kinematics import in_chains, moved_links, rigid_links
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, PosedObject
from asset2sim.physics.support_polygon import DOWNWARD, SupportPolygon, floor_pushes, leaning_on
from asset2sim.physics.terms import JointLoad, JointTerms
from schemas.features import Features, JointFeatures
from schemas.finding import Notes
from schemas.mechanism import CAUGHT, STAYS, EffortRange, MechanismName
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings
from schemas.support import SupportKind

MOTIONS = {"prismatic": "slider", "continuous": "spin"}
"""Type of a joint → its motion in the tables; the others are hinges."""
UP = np.array([0.0, 0.0, 1.0])
SAFE_SHARE = 0.9
"""Share of the force that tips or slides the object, or that a hand should need at most, that a part is made to take:
engines and statics differ by some percent, and feet are not where hulls say."""
STANDING_PART_N = 1e6
"""Force that no hand has, N: a part on which the object stands is not moved by hand."""
FELT_MARGIN = 1.25
"""Effort that a part is made for where no prompt states one, over the least of its kind: engines differ."""
BORNE_SHARE = 0.2
"""Most of the force that tips or slides an object which its part's least effort may be: a spring whose end takes half
of it starts at a fourth."""
FIRMER, LIGHTER = 1.5, 0.75
"""What words for high and low damping do to the largest force that a part may take."""
STIFF_SHARE = 0.5
"""Least effort of a part that a user calls hard to move, over the most of its kind: nobody says so of a tenth of it."""
LOW_LEVELS = ("super low", "low")
"""Words for low damping, of parts that are as light as still holds them."""


@dataclass(frozen=True)
class MovedPart:
    """The part that a joint moves: its longest edge (m), its weight (N), or what it bears of the object where that is
    more, whether it is round about the joint's axis, so that it is turned about itself, and how far it reaches along
    that axis, over how far across."""

    length_m: float = 0.0
    weight_n: float = 0.0
    round: bool = False
    extent: float = 1.0


UNKNOWN_PART = MovedPart()


@dataclass(frozen=True)
class Handling:
    """How people handle one joint's part: the forces at its edge that its kind should take, whether it is left
    ``anywhere``, whether springs carry its weight (``counterbalanced``), what its mechanism is, whether it is a door or
    lid (``leaf``), the force at its edge at which its catch lets go (None: that of most), the ``lever`` of that edge
    (m; 1 for a slider), and the forces there (N), to larger and to smaller positions, that tip over or slide the
    object: infinite where none does, or where a hand holds it meanwhile."""

    range: EffortRange
    anywhere: bool
    counterbalanced: bool
    mechanism: MechanismName = "friction"
    leaf: bool = False
    lets_go_n: float | None = None
    lever: float = 1.0
    tips_upward: float = math.inf
    tips_downward: float = math.inf
    click_rad: float = 0.0
    """Turn from one detent to the next; 0 without."""
    asked_n: float | None = None
    """Force at its edge that moving it takes, as the user says, N."""
    judged: EffortRange | None = None
    """The range by which it is judged where that is wider: of what is asked, and of its kind."""
    ground_load: float = 0.0
    """Effort of the ground on the joint where the object stands on its part by a spring, N·m or N."""

    @property
    def least_effort(self) -> float:
        """The effort (N·m or N) that a part is made to take at least."""
        return FELT_MARGIN * self.lever * self.range.least_n

    @property
    def most_upward(self) -> float:
        """The largest effort (N·m or N) that a hand should need to larger positions."""
        return SAFE_SHARE * self.lever * min(self.range.most_n, self.tips_upward)

    @property
    def most_downward(self) -> float:
        """The largest effort (N·m or N) that a hand should need to smaller positions."""
        return SAFE_SHARE * self.lever * min(self.range.most_n, self.tips_downward)


UPRIGHT = 0.9
"""|axis · z| from which a door slides up, a sash or a garage's: springs or weights balance it (AAMA 902: balances of
hung windows)."""


def handling(
    features: Features, joint: JointFeatures, proposal: JointProposal | None, moved: MovedPart = UNKNOWN_PART
) -> Handling:
    """The handling of one joint by its part, the object's category and the words about it; no object stands yet."""
    motion = "slider" if joint.prismatic else "spin" if moved.round else "hinge"
    label = carried_label(features, joint)
    named = held_as(part_name(label, joint.child, joint.name), features.category, motion, moved.extent)
    box = features.link_boxes.get(joint.child, (0.0, 0.0, 0.0))
    shaped = shape_name(joint.type, joint.axis_in_root, box, features.closed_size, joint.lower, joint.upper)
    named = by_shape(named, shaped, features.category, label, joint.child, joint.name)
    named = swinging(named, features.category, joint.type, joint.lower, joint.upper)
    stays = stays_put(named, features.category, joint, proposal)
    named = "handwheel" if named == "wheel" and stays else named
    if joint.type == "continuous" and turns_as_its_kind(named, features.category):
        motion = "spin"
    row = part_effort(named, features.category, motion, moved.length_m, loose=not stays)
    level = None if proposal is None else proposal.damping_level
    factor = FIRMER if level in ("high", "super high") else LIGHTER if level in LOW_LEVELS else 1.0
    said = {1.0: "", FIRMER: "; firmer, as asked", LIGHTER: "; lighter, as asked"}[factor]
    least = max(row.least_n if stays else 0.0, row.least_share * moved.weight_n) * min(factor, 1.0)
    if proposal is not None and proposal.stiff:
        least = max(least, STIFF_SHARE * row.most_n)
    if is_sprung(proposal):
        # A spring that is stated for a part of no row of its own is as light as it is stated.
        own = row != part_effort("", features.category, motion, moved.length_m)
        least = row.least_n * min(factor, 1.0) if own else 0.0
    # The share of a load that no hand moves, as of a car on its wheels, is what moving it takes.
    most = max(factor * row.most_n, FELT_MARGIN * least / SAFE_SHARE)
    stated = EffortRange(kind=row.kind, least_n=least, most_n=most, source=row.source + said, braced=row.braced)
    usual = mechanism(named, features.category, MOTIONS.get(joint.type, "hinge"))
    lifts = named == "door" and joint.prismatic and abs(joint.axis_in_root[2]) > UPRIGHT
    kind = named_mechanism("strut" if lifts else usual.kind, proposal)
    lets_go = usual.lets_go_n if kind == usual.kind else None
    click_rad = usual.click_rad if kind == "detent" else 0.0
    leaf = named in ("door", "lid")
    return Handling(stated, row.anywhere, row.counterbalanced, kind, leaf, lets_go, click_rad=click_rad)


def named_mechanism(usual: MechanismName, proposal: JointProposal | None) -> MechanismName:
    """The mechanism of a part that ``usual``ly has this one: as the proposal names it, or else as its terms tell."""
    if proposal is None or proposal.mechanism is not None:
        return usual if proposal is None or proposal.mechanism is None else proposal.mechanism
    if is_sprung(proposal):
        return "spring return"
    if usual in CAUGHT or (proposal.holds in (None, usual in STAYS) and usual != "spring return"):
        return usual
    return "friction" if proposal.holds else "free"


def stays_put(part: str, category: str, joint: JointFeatures, proposal: JointProposal | None) -> bool:
    """Whether something besides the rubbing of its pins resists a joint: a spring, or what keeps it where it is left,
    by the proposal, else as its part usually has it."""
    if is_sprung(proposal):
        return True
    if proposal is not None and proposal.holds is not None:
        return proposal.holds
    if proposal is not None and proposal.mechanism is not None:
        return proposal.mechanism in STAYS
    return mechanism(part, category, MOTIONS.get(joint.type, "hinge")).kind in STAYS


def as_light_as_stated(kind: Handling) -> Handling:
    """The handling of a part whose user states damping, friction or spring, or whose file states a spring that is
    kept: as light as that."""
    stated = kind.range.model_copy(update={"least_n": 0.0, "source": f"{kind.range.source}; as light as stated"})
    return replace(kind, range=stated)


def as_strong_as_stated(usual: EffortRange | None, spring_n: float) -> EffortRange | None:
    """The range of forces of a part whose file states a spring that is kept, of ``spring_n`` (N) at its edge."""
    if usual is None or spring_n <= SAFE_SHARE * usual.most_n:
        return usual
    source = f"{usual.source}; as strong as its file's spring"
    return usual.model_copy(update={"most_n": spring_n / SAFE_SHARE, "source": source})


def standing_part(kind: Handling) -> Handling:
    """The handling of a part that is most of the object: it bears the rest, wherever it is left, and no hand moves it
    against the object's stand."""
    unbounded = kind.range.model_copy(update={"most_n": STANDING_PART_N})
    return replace(kind, range=unbounded, anywhere=True, tips_upward=math.inf, tips_downward=math.inf)


def carried_label(features: Features, joint: JointFeatures) -> str:
    """The label of the joint's child, or where that is a bare helper of the first labelled link that hangs from it."""
    name, seen = joint.child, set[str]()
    while name not in seen:
        seen.add(name)
        if features.link(name).label or features.link(name).has_geometry:
            return features.link(name).label
        name = next((item.child for item in features.joints if item.parent == name), name)
    return ""


def handlings(
    features: Features,
    item: PosedObject,
    proposals: Mapping[str, JointProposal],
    contact_friction: float,
    settings: PhysicsSettings,
    *,
    carried: SupportKind = SupportKind.FREESTANDING,
) -> dict[str, Handling]:
    """Joint → its handling as the object stands, at the final scale. Nothing tips over or slides that is fixed, or that
    a hand holds."""
    tree, poses, clouds, mass = item.tree, item.poses, item.clouds, item.mass
    support = leaning_on(item.cloud, item.center, mass, UP)
    pushes = floor_pushes(clouds, support) if carried is SupportKind.FREESTANDING else {}
    joints = {joint.name: joint for joint in tree}
    chained = in_chains(tree)
    found: dict[str, Handling] = {}
    for name in item.positions:
        joint, hinge = features.joint(name), joints[name]
        frame = poses[hinge.parent] @ hinge.child_to_parent
        links = rigid_links(tree, name)
        cloud = np.vstack([np.zeros((0, 3)), *(clouds[link] for link in links if link in clouds)])
        axis, origin = frame[:3, :3] @ hinge.axis, frame[:3, 3]
        length = float(np.ptp(cloud, axis=0).max()) if len(cloud) else 0.0
        weight = GRAVITY_M_S2 * sum(item.bodies[link].mass for link in links)
        # What rolls bears the object on its axle; a door or drawer that touches the floor hangs as ever.
        borne = sum(pushes.get(link, 0.0) for link in moved_links(tree, name)) if joint.type == "continuous" else 0.0
        part = MovedPart(length, max(weight, borne))
        if len(cloud) and not joint.prismatic:
            flat = np.ptp(cloud - np.outer(cloud @ axis, axis), axis=0).max()
            extent = float(np.ptp(cloud @ axis) / max(flat, 1e-9))
            part = replace(part, round=round_about(cloud, axis, origin), extent=extent)
        kind = handling(features, joint, proposals.get(name), part)
        ways = 1.0 if (joint.open or 0.0) >= (joint.closed or 0.0) else -1.0
        grip = grip_on(cloud, axis, origin, slides=joint.prismatic, opens=ways)
        if grip is None or name in chained:
            found[name] = replace(kind, range=kind.range.model_copy(update={"least_n": 0.0}))
            continue
        pressed = is_pressed(proposals.get(name)) or kind.mechanism == "bistable"
        light = mass < settings.held_by_hand_kg
        up, down = (
            math.inf
            if carried is not SupportKind.FREESTANDING
            or kind.range.braced
            or (pressed and light and sign * float(grip.direction @ UP) > -DOWNWARD)
            else bearable(support, grip.point, sign * grip.direction, contact_friction)
            for sign in (1.0, -1.0)
        )
        kind = replace(
            kind, lever=grip.lever, tips_upward=up, tips_downward=down, asked_n=asked_force(proposals.get(name), grip)
        )
        found[name] = replace(kind, range=as_borne(kind))
    return found


def as_borne(kind: Handling) -> EffortRange:
    """The range of forces with a least that the object bears: what stands light has parts that move lightly."""
    stated, borne = kind.range, BORNE_SHARE * min(kind.tips_upward, kind.tips_downward)
    if stated.least_n <= borne:
        return stated
    return stated.model_copy(update={"least_n": borne, "source": f"{stated.source}; as light as the object stands"})


def asked_force(proposal: JointProposal | None, grip: Grip) -> float | None:
    """The force at a part's edge (N) that moving it takes, as its user says in N, or about its hinge in N·m."""
    if proposal is None or proposal.effort_n is not None or proposal.effort_nm is None:
        return None if proposal is None else proposal.effort_n
    return proposal.effort_nm / grip.lever


def as_asked(name: str, kind: Handling, load: float, notes: Notes) -> Handling:
    """The handling of a part that takes what its user says, as far as the object stands it; as usual, which is said,
    where its own weight, a ``load`` (N·m or N) at the start, takes more. What a catch holds is asked of that alone."""
    if kind.asked_n is None:
        return kind
    force, weight = min(kind.asked_n, SAFE_SHARE * min(kind.tips_upward, kind.tips_downward)), abs(load) / kind.lever
    caught = kind.mechanism in CAUGHT
    if force < kind.asked_n or (weight >= force and not caught):
        why = "with more the object tips over or slides" if force < kind.asked_n else f"it weighs {weight:.3g} N there"
        message = f"joint '{name}': {kind.asked_n:.3g} N at its edge, as asked, is not what moving it takes: {why}"
        notes.warn("effort_unmet", message, joint=name, value=kind.asked_n, limit=max(force, weight))
    if weight >= force and not caught:
        return replace(kind, asked_n=None)
    said = f"as asked, {kind.asked_n:.3g} N"
    least = min(kind.range.least_n, force / FELT_MARGIN) if caught else force / FELT_MARGIN
    stated = {"least_n": least, "most_n": force / SAFE_SHARE, "source": said}
    asked = kind.range.model_copy(update=stated)
    # A spring that carries a flap may be stronger, and what an engine makes tip may have to be looser than statics say.
    bounds = min(least, kind.range.least_n), max(asked.most_n, kind.range.most_n)
    wide = {"least_n": bounds[0], "most_n": bounds[1], "source": f"{kind.range.source}; {said}"}
    judged = kind.range.model_copy(update=wide)
    return replace(kind, range=asked, judged=judged, lets_go_n=force if caught else kind.lets_go_n)


def is_sprung(proposal: JointProposal | None) -> bool:
    """Whether a spring is proposed, in whatever terms."""
    terms = ("stiffness", "spring_hz", "returns_s", "press_start", "press_end")
    return proposal is not None and any(getattr(proposal, term) is not None for term in terms)


def is_pressed(proposal: JointProposal | None) -> bool:
    """Whether a part is pressed against its spring: one hand then holds a light object."""
    return proposal is not None and (proposal.press_start is not None or proposal.press_end is not None)


def bearable(support: SupportPolygon, point: Array, direction: Array, friction: float) -> float:
    """The force (N) at a (3,) point along a (3,) unit direction at which the object tips over or slides."""
    limits = (support.tips_at(point, direction), support.slides_at(direction, friction))
    return min((limit for limit in limits if limit is not None), default=math.inf)


def felt_press(
    proposal: JointProposal, kind: Handling, terms: JointTerms, moved: JointLoad, notes: Notes
) -> JointProposal | None:
    """The proposal with a press of a part of its kind, where that which it states is less or more, or the spring that
    it states by other terms, such as how fast it returns, is too weak to be felt; None where there is no spring, or one
    of its kind."""
    stiffness, stated = terms.stiffness.value, press_forces(proposal)
    least, most = kind.range.least_n, kind.range.most_n
    starts_at = stiffness * abs(moved.rest - terms.spring_reference) / moved.reach if stated is None else stated[0]
    if stiffness <= 0.0 or least <= starts_at <= (math.inf if stated is None else most):
        return None
    start = FELT_MARGIN * least if starts_at < least else SAFE_SHARE * most
    message = (
        f"joint '{proposal.name}': its spring, as stated, presses with {starts_at:.3g} N where it starts; a "
        f"{kind.range.kind} takes {least:.3g} to {most:.3g} N, so that it is made for {start:.3g} N"
    )
    notes.info("press_assumed", message, joint=proposal.name, value=starts_at, limit=start)
    end = proposal.press_end if starts_at < least else None
    other = {"press_end": end, "returns_s": None, "spring_hz": None, "stiffness": None}
    return proposal.model_copy(update={"press_start": start, **other})


def bounded_press(
    proposal: JointProposal, kind: Handling, outward: float, settings: PhysicsSettings, notes: Notes
) -> JointProposal:
    """The proposal with its press forces lowered together so that none exceeds ``press_margin`` of what tips or slides
    the object when the part is pressed towards ``outward`` (±1)."""
    stated = {name: getattr(proposal, name) for name in ("press_start", "press_end")}
    largest = max((value for value in stated.values() if value is not None), default=0.0)
    most = settings.press_margin * (kind.tips_upward if outward > 0.0 else kind.tips_downward)
    if largest <= most:
        return proposal
    message = (
        f"joint '{proposal.name}': a press of {largest:.3g} N would tip or slide the object; its spring is made for "
        f"{most:.3g} N"
    )
    notes.info("press_bounded", message, joint=proposal.name, value=largest, limit=most)
    lowered = {name: None if value is None else value * most / largest for name, value in stated.items()}
    return proposal.model_copy(update=lowered)
