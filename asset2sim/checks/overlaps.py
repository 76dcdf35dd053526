"""Φ over all pairs of links in the initial state, with parent and child, which the engines' filters leave out."""

from collections.abc import Mapping
from pathlib import Path

import pybullet

from asset2sim.checks.rig import CauseOf
from asset2sim.engines.contacts import by_pair
from asset2sim.engines.pybullet_object import loaded
from schemas.interaction import OverlapPair
from schemas.settings import EngineSettings

FLAGS = (
    pybullet.URDF_USE_SELF_COLLISION
    | pybullet.URDF_USE_SELF_COLLISION_INCLUDE_PARENT
    | pybullet.URDF_IGNORE_VISUAL_SHAPES
)


def overlap_pairs(
    urdf: Path, positions: Mapping[str, float], cause: CauseOf, settings: EngineSettings
) -> tuple[OverlapPair, ...]:
    """Every pair of links that overlaps at these joint positions (rad, m), the worst first, each with its cause.

    A link and its parent are left out where the joint between them is fixed: they are one body. Raises AssetError
    (engine_refused) where PyBullet, whose hulls and contact points these are, refuses the file.
    """
    with loaded(urdf, fixed_base=True, timestep_s=settings.timestep_s, flags=FLAGS) as item:
        item.place(positions)
        joints = [item.client.getJointInfo(item.body, index) for index in range(item.client.getNumJoints(item.body))]
        names = item.link_names
        related = {frozenset((names[info[0]], names[info[16]])): info[2] != pybullet.JOINT_FIXED for info in joints}
        pairs = by_pair(item.contacts())
    return tuple(
        OverlapPair(
            pair=pair,
            related=frozenset((pair.link_a, pair.link_b)) in related,
            cause=cause(pair.link_a, pair.link_b, positions),
        )
        for pair in pairs
        if related.get(frozenset((pair.link_a, pair.link_b)), True)
    )
