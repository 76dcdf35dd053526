"""Hulls cut until their links no longer overlap, measured in PyBullet, or in MuJoCo where that is not installed."""

from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext

from asset2sim.assets.hulls import Hulls
from asset2sim.engines.static_object import with_pybullet
from asset2sim.physics.arrays import Array
from asset2sim.refinement.collision.hull_world import HullWorld, clear_pose
from asset2sim.refinement.collision.trim import Cut, PlaneCut, Trimmer


def hull_world(trimmer: Trimmer) -> AbstractContextManager[HullWorld]:
    """A world for the hulls of a trimmer; it follows later cuts."""
    if with_pybullet():
        from asset2sim.refinement.collision.pybullet_hulls import pybullet_hulls

        return pybullet_hulls(trimmer)
    from asset2sim.refinement.collision.mujoco_hulls import MuJoCoHulls

    return nullcontext(MuJoCoHulls(trimmer))


def cleared(
    hulls: Hulls,
    poses: Mapping[str, Array],
    pairs: Iterable[tuple[str, str]],
    exact: frozenset[str] = frozenset(),
    planes: list[PlaneCut] | None = None,
) -> tuple[Hulls, tuple[Cut, ...]]:
    """The hulls cut until none of the link pairs overlap at these link-to-root poses, and what each link lost.

    Overlaps that would take too much of a hull are left as they are; links in ``exact`` may lose least; ``planes``
    gets the cuts that were tried.
    """
    trimmer = Trimmer(hulls, exact, planes)
    with hull_world(trimmer) as world:
        clear_pose(world, poses, list(pairs))
    return trimmer.result(), tuple(trimmer.cuts.values())
