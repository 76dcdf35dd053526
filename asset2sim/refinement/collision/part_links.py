"""Separate links that overlap in a state by cutting their collision hulls."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

from asset2sim.assets.folder import Folder, replace_hulls, write_urdf
from asset2sim.assets.hulls import Hulls, exact_links
from asset2sim.engines.static_object import phi_at, with_pybullet
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import link_to_root, tree_of, written_joints
from asset2sim.refinement.collision.hull_world import HullWorld, clear_pose
from asset2sim.refinement.collision.trim import Cut, PlaneCut, Trimmer, contact_pairs
from asset2sim.refinement.context import RefinementContext
from asset2sim.refinement.position_bands import Pose
from schemas.vocabulary import CollisionMode


@contextmanager
def hull_world(trimmer: Trimmer) -> Iterator[HullWorld]:
    """A world for the hulls of a trimmer; it follows later cuts."""
    if with_pybullet():
        from asset2sim.engines.pybullet_object import empty_client
        from asset2sim.refinement.collision.pybullet_hulls import PyBulletHulls

        with empty_client() as client:
            yield PyBulletHulls(client, trimmer)
    else:
        from asset2sim.refinement.collision.mujoco_hulls import MuJoCoHulls

        yield MuJoCoHulls(trimmer)


def cut_until_clear(
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


@dataclass(frozen=True)
class CutAttempt:
    """A state and the hulls cut for it, with Φ (m) in a fresh world before and after."""

    positions: Pose
    hulls: Hulls
    phi_before: float
    phi: float
    cut: tuple[Cut, ...] = ()

    @property
    def changed(self) -> bool:
        """Whether collision hulls were cut."""
        return bool(self.cut)


def cut_attempt(loop: RefinementContext, folder: Folder, positions: Pose) -> CutAttempt:
    """Cut hulls that overlap at these positions apart; the folder keeps its shapes."""
    before = phi_at(folder.urdf, positions, loop.settings.engine)
    whole = CutAttempt(positions, loop.hulls, before, before)
    authored_shapes = loop.settings.collision.mode is CollisionMode.KEEP
    if authored_shapes or before <= loop.settings.search.target_phi_m:
        return whole
    return cut_apart(loop, folder, whole)


def phi_with_hulls(loop: RefinementContext, folder: Folder, hulls: Hulls, positions: Pose) -> float:
    """Φ (m) with other collision hulls; the folder is restored afterwards."""
    write_urdf(loop.extraction, loop.overlay, replace_hulls(folder, hulls), loop.settings.physics)
    phi = phi_at(folder.urdf, positions, loop.settings.engine)
    write_urdf(loop.extraction, loop.overlay, replace_hulls(folder, loop.hulls), loop.settings.physics)
    return phi


def cut_apart(loop: RefinementContext, folder: Folder, start: CutAttempt) -> CutAttempt:
    """The attempt with hulls cut apart as far as the bounds allow; ``start`` itself if Φ does not fall."""
    features, overlay = loop.extraction.features, loop.overlay
    tree = tree_of(written_joints(features, overlay), overlay.scale)
    poses = link_to_root(tree, features.root, start.positions)
    links = [link.name for link in features.links]
    trimmed, cuts = cut_until_clear(
        start.hulls,
        poses,
        contact_pairs(features.joints, links, loop.passing),
        exact_links(loop.extraction),
        loop.log.planes,
    )
    if not cuts:
        return start
    after = phi_with_hulls(loop, folder, trimmed, start.positions)
    return replace(start, hulls=trimmed, phi=after, cut=cuts) if after < start.phi else start
