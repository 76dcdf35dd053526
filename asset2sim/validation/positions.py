"""Initial joint positions: the requested state, and where every other joint starts; those that follow others start
and go as far as their leaders say."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from types import MappingProxyType

import numpy as np
from scipy.optimize import minimize

from asset2sim.guidance.parts import part_name
from asset2sim.guidance.tables import mechanism, sizes
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, in_chains, link_to_root, mimics_of, tree_of
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, Body, joint_space
from asset2sim.validation.limits import Range
from schemas.features import Features, JointFeatures, Mimic
from schemas.finding import Notes
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source

ROUNDING_SHARE = 1e-3
"""How far outside its limits, as a share of the range, a position may lie by rounding: prompts round numbers."""
OFF_BALANCE = 1e-3
"""Shift of a chain, rad or m, before gravity lays it: one that stands upright would stay so."""
WIDEN_SHARE = 0.1
"""How far outside its limits, as a share of the range, a requested position may lie and widen them."""


@dataclass(frozen=True)
class Start:
    """Start position of one joint, rad or m at the final scale; ``asked``: the position that the proposal states, None
    where it states none; ``requested``: it does as the user asked; ``hangs``: as gravity leaves a chain, which no
    friction holds up."""

    range: Range
    position: float
    source: Source
    requested: bool
    asked: float | None = None
    hangs: bool = False


def initial_positions(
    ranges: Mapping[str, Range],
    proposed: Mapping[str, float],
    rests: Mapping[str, float],
    asked: Collection[str],
    scale: float,
    source: Source,
    settings: PhysicsSettings,
    notes: Notes,
    stated: Mapping[str, float] = MappingProxyType({}),
    known: Features | None = None,
) -> dict[str, Start]:
    """Where every movable joint starts: as proposed, else where its spring brings it (``rests``), else where its file
    has it (``stated``), else closed where geometry is sure of it, else at zero. So does what one sets, and neither
    opens nor shuts (a tap's lever, an arm of a lamp), of an object that is ``known`` and of a kind that the table of
    sizes has, and a part of a file in metres that is drawn on its way, unless its shape leaves no doubt. All at the
    authored scale."""
    starts: dict[str, Start] = {}
    for name, span in ranges.items():
        if name in proposed:
            wanted = proposed[name] * (scale if span.joint.prismatic else 1.0)
            requested = name in asked
            widened, position = position_within(span, wanted, requested, notes)
            starts[name] = Start(widened, position, Source.USER if requested else source, requested, asked=position)
        else:
            rest = rests.get(name)
            if rest is not None:
                at = span.clamp(without_whole_turns(span, rest * (scale if span.joint.prismatic else 1.0)))
                starts[name] = Start(span, at, Source.RULE, False)
                continue
            if name in stated:
                at = span.clamp(without_whole_turns(span, stated[name] * (scale if span.joint.prismatic else 1.0)))
                starts[name] = Start(span, at, Source.AUTHORED, False)
                continue
            is_set = (
                known is not None and known.category in sizes() and part_and_role(known, span.joint)[1] == "control"
            )
            least = 1.0 if known is not None and known.metric and drawn_within(span) else settings.sure_of_closed
            sure = span.joint.openness_confidence >= least and not is_set
            starts[name] = Start(span, span.clamp(span.closed if sure else 0.0), Source.RULE, False)
    return starts


def drawn_within(span: Range) -> bool:
    """Whether a joint's zero, where its file draws its part, lies between its ends."""
    edge = ROUNDING_SHARE * span.span
    return span.lower is not None and span.upper is not None and span.lower + edge < 0.0 < span.upper - edge


def hanging_starts(
    starts: Mapping[str, Start], tree: Sequence[TreeJoint], root: str, bodies: Mapping[str, Body]
) -> dict[str, Start]:
    """The starts of a held object, with the joints of chains for which nothing states one where gravity leaves them: a
    hose hangs from its hydrant, and does not stand out from it by friction."""
    names = [name for name in in_chains(tree) if name in starts and starts[name].source is Source.RULE]
    if not names:
        return dict(starts)
    others = {name: start.position for name, start in starts.items()}
    weights = {name: body.mass * GRAVITY_M_S2 for name, body in bodies.items()}

    def energy(at: Array) -> tuple[float, Array]:
        """Of gravity, J, and its slope."""
        positions = others | dict(zip(names, at.tolist(), strict=True))
        space, poses = joint_space(tree, root, bodies, positions), link_to_root(tree, root, positions)
        heights = {name: float(poses[name][2, :3] @ body.com + poses[name][2, 3]) for name, body in bodies.items()}
        pulls = dict(zip(space.names, space.gravity.tolist(), strict=True))
        return sum(weights[name] * heights[name] for name in bodies), -np.array([pulls[name] for name in names])

    spans = [starts[name].range for name in names]
    first = [span.clamp(starts[name].position + OFF_BALANCE) for name, span in zip(names, spans, strict=True)]
    bounds = [(span.lower, span.upper) for span in spans]
    found = minimize(energy, first, jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-12, "gtol": 1e-6})
    hung = dict(zip(names, found.x.tolist(), strict=True))
    return {**starts, **{name: replace(starts[name], position=at, hangs=True) for name, at in hung.items()}}


def without_whole_turns(span: Range, position: float) -> float:
    """The position with whole turns taken out of a hinge's angle, where that brings it within its limits."""
    if span.joint.prismatic:
        return position
    if span.lower is None or span.upper is None:
        return math.remainder(position, 2.0 * math.pi)
    middle = (span.lower + span.upper) / 2.0
    near = middle + math.remainder(position - middle, 2.0 * math.pi)
    return near if span.lower <= near <= span.upper and not span.lower <= position <= span.upper else position


def position_within(span: Range, wanted: float, requested: bool, notes: Notes) -> tuple[Range, float]:
    """The position that a proposal means within a range, widened slightly where the user's state needs it.

    Whole turns are taken out of a hinge's angle. Beyond the margin the position is clamped: a proposal far outside the
    limits is a mistake, not a wish.
    """
    lower, upper, name = span.lower, span.upper, span.joint.name
    wanted = without_whole_turns(span, wanted)
    if lower is None or upper is None or lower <= wanted <= upper:
        return span, wanted
    excess = max(lower - wanted, wanted - upper)
    if excess <= ROUNDING_SHARE * span.span:
        return span, span.clamp(wanted)
    if requested and excess <= WIDEN_SHARE * span.span:
        message = (
            f"joint '{name}': limits {lower:.4g} to {upper:.4g} widened to hold the requested position {wanted:.4g}"
        )
        notes.warn("limits_widened", message, joint=name, value=wanted, limit=lower if wanted < lower else upper)
        return replace(span, lower=min(lower, wanted), upper=max(upper, wanted), source=Source.USER), wanted
    clamped = span.clamp(wanted)
    message = (
        f"joint '{name}': position {wanted:.4g} lies outside its limits {lower:.4g} to {upper:.4g}; clamped to "
        f"{clamped:.4g}"
    )
    notes.warn("position_clamped", message, joint=name, value=wanted, limit=clamped)
    return span, clamped


def part_and_role(features: Features, joint: JointFeatures) -> tuple[str, str]:
    """Name of the part that a joint carries, and its role: it opens, or it is set, as a tap's lever is."""
    part = part_name(features.link(joint.child).label, joint.child, joint.name)
    return part, mechanism(part, features.category, "slider" if joint.prismatic else "hinge").role


def note_guessed_ends(
    features: Features, starts: Mapping[str, Start], asked: Collection[str], sure: float, notes: Notes
) -> None:
    """A warning for every door, lid or drawer (handles lie to either side) of which its shape does not say, to the
    confidence ``sure``, which end is closed: what is asked counts from a guess, unless it is ``asked`` as a number."""
    for name, start in starts.items():
        joint = start.range.joint
        part, role = part_and_role(features, joint)
        plain = joint.type != "continuous" and joint.mimic is None and role == "main"
        stated = f"initial_joint_positions.{name}" in asked
        if not plain or stated or joint.openness_confidence >= sure:
            continue
        other = f"{start.range.open:.4g} open" + (f"; {joint.other_reading}" if joint.other_reading else "")
        message = (
            f"joint '{name}' ({part}): which end is closed is a guess ({joint.openness_confidence:.2g} sure): taken is "
            f"{start.range.closed:.4g}, and {other}; look, and state its position in overrides.csv "
            "or in words where that is wrong"
        )
        notes.warn("closed_end_guessed", message, joint=name, value=joint.openness_confidence, limit=sure)


SHARES = (0.0, 0.5, 1.0)
"""Shares of each joint's range."""
MOST_COMBINED = 3
"""Joints up to which every combination of shares is taken; 27 poses."""


def spanning_poses(starts: Mapping[str, Start]) -> list[dict[str, float]]:
    """Sample poses (joint → rad or m): the start, then every combination of ends and middles; with more joints than
    ``MOST_COMBINED``, all joints together and every other one."""
    names = list(starts)
    ranges = [starts[name].range for name in names]
    if len(names) <= MOST_COMBINED:
        combinations = list(product(SHARES, repeat=len(names)))
    else:
        even = [index % 2 == 0 for index in range(len(names))]
        combinations = [tuple(share for _ in names) for share in SHARES]
        combinations += [tuple(float(flag is first) for flag in even) for first in (True, False)]
    poses = [{name: start.position for name, start in starts.items()}]
    for shares in combinations:
        poses.append({n: at_share(span, share) for n, span, share in zip(names, ranges, shares, strict=True)})
    return poses


def at_share(span: Range, share: float) -> float:
    """The position at a share of a range; of a whole turn for continuous joints."""
    if span.lower is None or span.upper is None:
        return 2.0 * math.pi * share * (2.0 / 3.0)  # both ends of a whole turn are the same place
    return span.lower + share * (span.upper - span.lower)


def leaders_positions(
    features: Features, proposed: Mapping[str, float], asked: Collection[str], notes: Notes
) -> tuple[dict[str, float], frozenset[str]]:
    """The proposed positions (authored scale) without those of followers, and the names that the user asks for. Where a
    user asks for a follower's position and for none of its leader's, the leader goes where it takes the follower
    there."""
    positions, wanted = dict(proposed), set(asked)
    for joint in features.joints:
        if joint.mimic is None or joint.name not in positions:
            continue
        position, leader = positions.pop(joint.name), joint.mimic.joint
        if joint.name in asked and leader not in asked:
            positions[leader] = joint.mimic.leader_at(position)
            wanted.add(leader)
            message = f"joint '{joint.name}' follows '{leader}', which is set to {positions[leader]:.4g} for it"
            notes.info("leader_moved", message, joint=leader, value=positions[leader])
    return positions, frozenset(wanted)


def starts_of_followers(
    features: Features, starts: Mapping[str, Start], scale: float, notes: Notes
) -> dict[str, Start]:
    """The starts with followers where their leaders start, and as far as those take them (final scale); a finding
    for each says which loaders honour it."""
    placed = dict(starts)
    for name, mimic in mimics_of(tree_of(features.joints, scale)).items():
        if name in starts and mimic.joint in starts:
            leader = starts[mimic.joint]
            span = following(starts[name].range, leader.range, mimic)
            message = (
                f"joint '{name}' follows '{mimic.joint}', {mimic.multiplier:.4g} × its position + {mimic.offset:.4g}: "
                "bound in the checks of every engine, in MJCF and in USD; of plain URDF loaders MuJoCo's binds it, "
                "PyBullet's leaves it loose"
            )
            notes.info("mimic", message, joint=name, value=mimic.multiplier)
            placed[name] = replace(starts[name], range=span, position=mimic.at(leader.position), source=leader.source)
    return placed


def following(span: Range, leader: Range, mimic: Mimic) -> Range:
    """A follower's range and ends as its leader's have them."""
    lower, upper = None, None
    if leader.lower is not None and leader.upper is not None and span.joint.type != "continuous":
        lower, upper = sorted((mimic.at(leader.lower), mimic.at(leader.upper)))
    closed, opened = mimic.at(leader.closed), mimic.at(leader.open)
    return replace(span, lower=lower, upper=upper, closed=closed, open=opened, source=leader.source)
