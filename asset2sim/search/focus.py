"""Focus joints: which joints can separate a colliding pair of links."""

from collections.abc import Sequence

from schemas.features import JointFeatures
from schemas.measurement import ContactPair

MOST = 4
"""Joints searched at once, at most: pairs further apart in the tree are separated by the joints nearest to them."""


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
