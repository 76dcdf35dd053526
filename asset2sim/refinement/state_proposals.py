"""Proposals over the focus joints: along one joint, seeded perturbations, and a systematic grid over two."""

import itertools
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from asset2sim.refinement.position_bands import Band, Pose
from schemas.features import JointFeatures
from schemas.interaction import ContactPair

LINE = 24
"""Positions tried to each side along one joint's band: 10 % of a range in steps of 0.4 %."""
PERTURBATIONS = 48
"""Random poses tried around the best on stagnation."""
GRID = 13
"""Positions per joint of the systematic search over pairs of focus joints."""


def poses_along(best: Pose, joint: str, band: Band) -> Iterator[Pose]:
    """Poses that move one joint through its band, nearest to the requested position first."""
    offsets = np.linspace(0.0, 1.0, LINE + 1)[1:]
    yield {**best, joint: band.requested}
    for share in offsets:
        for end in (band.low, band.high):
            if end != band.requested:
                yield {**best, joint: band.requested + float(share) * (end - band.requested)}


def poses_around(best: Pose, focus: Sequence[str], bands: Mapping[str, Band], seed: int) -> Iterator[Pose]:
    """Seeded perturbations of the best pose over the focus joints: small ones first, up to the whole band."""
    random = np.random.default_rng(seed)
    for index in range(PERTURBATIONS):
        size = (index + 1) / PERTURBATIONS
        moved = dict(best)
        for name, step in zip(focus, random.uniform(-1.0, 1.0, len(focus)) * size, strict=True):
            moved[name] = bands[name].clamp(best[name] + float(step) * (bands[name].high - bands[name].low))
        yield moved


def pose_grid(best: Pose, focus: Sequence[str], bands: Mapping[str, Band]) -> Iterator[Pose]:
    """Every combination over each pair of focus joints' bands."""
    for first, second in itertools.combinations(focus, 2):
        for a in np.linspace(bands[first].low, bands[first].high, GRID):
            for b in np.linspace(bands[second].low, bands[second].high, GRID):
                yield {**best, first: float(a), second: float(b)}


def in_groups(
    best: Pose, focus: Sequence[str], bands: Mapping[str, Band], joints: Sequence[JointFeatures]
) -> Iterator[Pose]:
    """Every combination of two groups of joints, each at one share of its bands: those that hang from one link by axes
    parallel to a focus joint's. The flaps of a carton cannot all stand at one angle: one pair has to be lower."""
    groups = [alike_joints(joints, name, bands) for name in focus[:2]]
    if len(groups) < 2 or groups[0] == groups[1] or len(groups[0]) + len(groups[1]) < 3:
        return
    for shares in itertools.product(np.linspace(0.0, 1.0, GRID), repeat=2):
        moved = dict(best)
        for group, share in zip(groups, shares, strict=True):
            for name in group:
                band = bands[name]
                moved[name] = band.low + float(share) * (band.high - band.low)
        yield moved


def alike_joints(joints: Sequence[JointFeatures], name: str, bands: Mapping[str, Band]) -> frozenset[str]:
    """The joints with a band that hang from the same link as this one, by an axis parallel to its own; itself too."""
    own = next(joint for joint in joints if joint.name == name)
    return frozenset(
        joint.name
        for joint in joints
        if joint.name in bands
        and joint.parent == own.parent
        and abs(float(np.dot(joint.axis_in_root, own.axis_in_root))) > PARALLEL
    )


PARALLEL = 0.99
"""Cosine of the angle between two unit axes from which they are parallel."""
MOST = 4
"""Most joints searched at once: the joints nearest to a pair of links are the ones that separate it."""


def path_to_root(joints: Sequence[JointFeatures], link: str) -> list[str]:
    """The joints between a link and the root, nearest first."""
    above = {joint.child: joint for joint in joints}
    path: list[str] = []
    while link in above:
        path.append(above[link].name)
        link = above[link].parent
    return path


def focus_joints(
    joints: Sequence[JointFeatures], pairs: Sequence[ContactPair], movable: Sequence[str]
) -> tuple[str, ...]:
    """The movable joints on the tree path between the links of the worst pair that has any, nearest to the links first.

    Joints common to both links' paths to the root move both alike and cannot separate them.
    """
    for pair in pairs:
        first, second = path_to_root(joints, pair.link_a), path_to_root(joints, pair.link_b)
        between = [name for name in first if name not in second] + [name for name in second if name not in first]
        focus = [name for name in between if name in movable]
        if focus:
            return tuple(focus[:MOST])
    return ()
