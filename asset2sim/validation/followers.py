"""Joints that follow others: where they start and how far they go is what their leaders say."""

from collections.abc import Collection, Mapping
from dataclasses import replace

from asset2sim.physics.kinematics import mimics_of, tree_of
from asset2sim.validation.limits import Range
from asset2sim.validation.positions import Start
from schemas.features import Features, Mimic
from schemas.finding import Notes


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
