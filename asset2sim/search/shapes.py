"""Part what overlaps in a state by collision shape: cut hulls, and decompose links whose hulls fill a hollow."""

from dataclasses import dataclass, replace

from asset2sim.apply import Folder, with_hulls, write_urdf
from asset2sim.collision.finer import finer_hulls
from asset2sim.collision.hulls import Hulls, exact_links
from asset2sim.collision.trim import Cut, contact_pairs
from asset2sim.engines.pybullet_overlaps import cleared
from asset2sim.engines.pybullet_penetration import contacts_at
from asset2sim.kinematics import link_to_root, locked, tree_of
from asset2sim.metrics.penetration import by_pair, penetration
from asset2sim.search.loop import Loop
from asset2sim.search.proposals import Pose
from schemas.features import Features, JointFeatures
from schemas.measurement import ContactPair
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import CollisionMode

DEEP_SHARE = 0.2
"""Share of a hull from which a cut is deep enough to ask whether the mesh is hollow there."""


@dataclass(frozen=True)
class Attempt:
    """A state with the collision shapes cut for it: Φ (m) in a fresh world before and after, and what was cut."""

    positions: Pose
    hulls: Hulls
    phi_before: float
    phi: float
    cut: tuple[Cut, ...] = ()
    decomposed: tuple[str, ...] = ()

    @property
    def changed(self) -> bool:
        """Whether the collision shapes are others than before."""
        return bool(self.cut or self.decomposed)

    @property
    def deepest(self) -> float:
        """The largest share of a hull that was cut away."""
        return max((cut.share for cut in self.cut), default=0.0)


def attempt(loop: Loop, folder: Folder, positions: Pose) -> Attempt:
    """Part what overlaps at these positions, if anything does; the folder is left with the shapes as they were.

    Hulls are cut; where that takes much of one, its link is decomposed first, for what overlaps may be hollow.
    """
    before = penetration(contacts_at(folder.urdf, positions, loop.settings.engine))
    whole = Attempt(positions, loop.hulls, before, before)
    authored_shapes = loop.settings.collision.mode is CollisionMode.KEEP
    if authored_shapes or before <= loop.settings.search.target_phi_m:
        return whole
    best = cut_apart(loop, folder, whole)
    deep = {cut.link for cut in best.cut if cut.share > DEEP_SHARE}
    if best.phi > loop.settings.search.target_phi_m:
        deep |= {link for pair in contacts_by_pair(loop, folder, best) for link in (pair.link_a, pair.link_b)}
    finer = {link: finer_hulls(loop.extraction, link, loop.overlay.scale, loop.cache) for link in sorted(deep)}
    found = {link: pieces for link, pieces in finer.items() if pieces is not None}
    if not found:
        return best
    hollow = Attempt(
        positions, {**loop.hulls, **found}, before, phi_with(loop, folder, {**loop.hulls, **found}, positions)
    )
    again = cut_apart(loop, folder, replace(hollow, decomposed=tuple(found)))
    gentler = again.phi <= loop.settings.search.target_phi_m and again.deepest < best.deepest
    return again if gentler or again.phi < best.phi - loop.settings.search.target_phi_m else best


def contacts_by_pair(loop: Loop, folder: Folder, at: Attempt) -> tuple[ContactPair, ...]:
    """The pairs that still overlap with an attempt's shapes."""
    write_urdf(loop.extraction, loop.overlay, with_hulls(folder, at.hulls), loop.settings.physics)
    pairs = by_pair(contacts_at(folder.urdf, at.positions, loop.settings.engine))
    write_urdf(loop.extraction, loop.overlay, with_hulls(folder, loop.hulls), loop.settings.physics)
    return pairs


def phi_with(loop: Loop, folder: Folder, hulls: Hulls, positions: Pose) -> float:
    """Φ (m) with other collision shapes, the folder left as it was."""
    pairs = contacts_by_pair(loop, folder, Attempt(positions, hulls, 0.0, 0.0))
    return sum(pair.penetration_m for pair in pairs)


def cut_apart(loop: Loop, folder: Folder, start: Attempt) -> Attempt:
    """The attempt with its hulls cut until they part, as far as that is possible; ``start`` itself if Φ does
    not fall."""
    features, overlay = loop.extraction.features, loop.overlay
    tree = tree_of(written_joints(features, overlay), overlay.scale)
    poses = link_to_root(tree, features.root, start.positions)
    links = [link.name for link in features.links]
    trimmed, cuts = cleared(start.hulls, poses, contact_pairs(features.joints, links), exact_links(loop.extraction))
    if not cuts:
        return start
    after = phi_with(loop, folder, trimmed, start.positions)
    return replace(start, hulls=trimmed, phi=after, cut=cuts) if after < start.phi else start


def written_joints(features: Features, overlay: PhysicsOverlay) -> list[JointFeatures]:
    """The joints as they are written: those that validation locked are fixed."""
    kept = {joint.name for joint in overlay.joints}
    return [joint if joint.name in kept or not joint.movable else locked(joint) for joint in features.joints]
