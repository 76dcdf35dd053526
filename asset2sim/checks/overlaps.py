"""Φ over all pairs of links in the initial state, with parent and child, which the engines' filters leave out."""

from collections.abc import Mapping
from pathlib import Path

import pybullet
from pybullet_utils.bullet_client import BulletClient

from asset2sim.checks.sweep import Cause
from asset2sim.engines.console import captured_console
from asset2sim.engines.contacts import ContactPoint, by_pair
from schemas.errors import AssetError
from schemas.interaction import OverlapPair
from schemas.vocabulary import FailureMode

FLAGS = (
    pybullet.URDF_USE_SELF_COLLISION
    | pybullet.URDF_USE_SELF_COLLISION_INCLUDE_PARENT
    | pybullet.URDF_IGNORE_VISUAL_SHAPES
)


def overlap_pairs(urdf: Path, positions: Mapping[str, float], cause: Cause) -> tuple[OverlapPair, ...]:
    """Every pair of links that overlaps at these joint positions (rad, m), the worst first, each with its cause.

    A link and its parent are left out where the joint between them is fixed: they are one body. Raises AssetError
    (engine_crash) where PyBullet, whose hulls and contact points these are, refuses the file.
    """
    client = BulletClient(connection_mode=pybullet.DIRECT)
    try:
        with captured_console():
            try:
                body = client.loadURDF(str(urdf), useFixedBase=True, flags=FLAGS)
            except pybullet.error:
                body = -1
        if body < 0:
            raise AssetError(FailureMode.ENGINE_CRASH, "engine_refused", f"PyBullet refuses {urdf.name}")
        names = {-1: client.getBodyInfo(body)[0].decode()}
        related: dict[frozenset[str], bool] = {}
        parents: list[tuple[int, int, bool]] = []
        for index in range(client.getNumJoints(body)):
            info = client.getJointInfo(body, index)
            names[index] = info[12].decode()
            moves = info[2] != pybullet.JOINT_FIXED
            parents.append((index, info[16], moves))
            if moves:
                client.resetJointState(body, index, positions.get(info[1].decode(), 0.0))
        for index, parent, moves in parents:
            related[frozenset((names[index], names[parent]))] = moves
        client.performCollisionDetection()
        points = [
            ContactPoint(names[point[3]], names[point[4]], float(point[8]))
            for point in client.getContactPoints(body, body)
        ]
    finally:
        client.disconnect()
    return tuple(
        OverlapPair(
            pair=pair,
            related=frozenset((pair.link_a, pair.link_b)) in related,
            cause=cause(pair.link_a, pair.link_b, positions, pair.depth_m),
        )
        for pair in by_pair(points)
        if related.get(frozenset((pair.link_a, pair.link_b)), True)
    )
