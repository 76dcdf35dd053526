"""Refine one asset in PyBullet: search its joint state, then cut collision hulls; ask a model where both fail. Flaps of
one carton may cross as drawn where both are closed."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from asset2sim.assets.authored_overlap import authored_shapes
from asset2sim.assets.folder import Folder, replace_hulls, write_urdf
from asset2sim.assets.hulls import Hulls, exact_links
from asset2sim.engines.static_object import MARGIN_M, contact_points, phi_at, static_object
from asset2sim.physics.kinematics import link_to_root, tree_of, written_joints
from asset2sim.refinement.ask_model import AskedSoFar, QuestionContext, model_asker
from asset2sim.refinement.collision.hull_world import candidates, clear_pose
from asset2sim.refinement.collision.let_joints_move import let_joints_move, sleeved_pairs
from asset2sim.refinement.collision.part_links import CutAttempt, cut_attempt, hull_world
from asset2sim.refinement.collision.trim import Trimmer, contact_pairs, cuts_of
from asset2sim.refinement.context import RefinementContext, trace_step, warning
from asset2sim.refinement.model_loop import refine_by_model
from asset2sim.refinement.notes import move_findings, note_cuts
from asset2sim.refinement.position_bands import Evaluator, Pose, band_of, moved_joints, reachable_bands
from asset2sim.refinement.search_state import refine_state
from schemas.features import Features
from schemas.finding import Finding, TraceStep
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import CollisionMode, Proposer, Source

CROSSING = 0.5
"""Cosine of the angle between two hinges' axes below which their parts cross rather than lie one upon the other."""


def crossing_flaps(
    features: Features, overlay: PhysicsOverlay, hulls: Hulls, exact: frozenset[str]
) -> tuple[tuple[str, str], ...]:
    """Pairs of links that hang from one link by hinges across each other, are of one kind, and overlap where both are
    closed by more than cutting parts: real flaps are thin and bend, and lie one upon another in any order. ``exact``
    are the links whose hulls are their meshes."""
    hinges = {joint.name: joint for joint in overlay.joints if joint.type == "revolute" and joint.lower is not None}
    parts = [joint for joint in features.movable_joints if joint.name in hinges and hulls.get(joint.child)]
    pairs = [
        (a.child, b.child)
        for a, b in combinations(parts, 2)
        if a.parent == b.parent
        and hinges[a.name].label == hinges[b.name].label
        and abs(float(np.dot(a.axis_in_root, b.axis_in_root))) < CROSSING
    ]
    if not pairs:
        return ()
    closed = {name: joint.closed for name, joint in hinges.items()}
    tree = tree_of(written_joints(features, overlay), overlay.scale)
    poses = link_to_root(tree, features.root, {**overlay.initial_positions, **closed})
    trimmer = Trimmer(hulls, exact, None)
    with hull_world(trimmer) as world:
        clear_pose(world, poses, pairs)
        return tuple(
            pair
            for pair in pairs
            if any(
                world.overlap(a, b, poses[a[0]], poses[b[0]], 2.0 * MARGIN_M) is not None
                for a, b in candidates(trimmer, poses, [pair])
            )
        )


@dataclass(frozen=True)
class RefinedState:
    """Overlay at the state found, the folder with the collision hulls it needs, trace and findings."""

    overlay: PhysicsOverlay
    folder: Folder
    trace: tuple[TraceStep, ...]
    findings: tuple[Finding, ...]


def lower_penetration(loop: RefinementContext, folder: Folder, questions: AskedSoFar) -> RefinedState:
    """Lower Φ: first by joint positions near the requested state; where that fails, by cutting collision hulls.

    Joint dynamics are derived again for joints that moved. A search proposes first, and a model is asked where links
    still overlap; or the model proposes every step (paper, "Refine the state").
    """
    loop = with_passing(loop, folder)
    overlay, settings = loop.overlay, loop.settings
    requested, reach = overlay.initial_positions, reachable_bands(overlay, settings.search)
    features = loop.extraction.features
    scene = QuestionContext(features, overlay, settings, folder.urdf, reach, questions, loop.guidance)
    if settings.search.proposer is Proposer.MODEL:
        return write_best(loop, folder, cut_or_kept(loop, folder, model_state(loop, folder, scene)))
    found = search_state(loop, folder, settings.search.closed_tolerance)
    best = cut_or_kept(loop, folder, found)
    tried = [found, requested]
    # Open a closed part slightly, and ask a model, only where smaller changes do not separate the links.
    for asked in (None, scene):
        if best.phi <= settings.thresholds.penetration_m:
            break
        wider = search_state(loop, folder, settings.search.state_tolerance, asked)
        if wider not in tried:
            tried.append(wider)
            again = cut_attempt(loop, folder, wider)
            best = again if again.phi < best.phi else best
    return write_best(loop, folder, best)


def with_passing(loop: RefinementContext, folder: Folder) -> RefinementContext:
    """The context whose overlay lets flaps pass that cross where both are closed, and what turns and slides in what it
    is drawn into, written; a finding for each pair."""
    features, overlay = loop.extraction.features, loop.overlay
    crossing = crossing_flaps(features, overlay, loop.hulls, exact_links(loop.extraction))
    joints, shapes = written_joints(features, overlay), authored_shapes(loop.extraction, overlay.scale)
    pairs = contact_pairs(joints, [link.name for link in features.links])
    deep = loop.settings.thresholds.penetration_m
    sleeved = sleeved_pairs(tree_of(joints, overlay.scale), features.root, pairs, shapes, deep)
    if not crossing and not sleeved:
        return loop
    flaps = (
        "cross as drawn where both are closed: they pass through each other, where real flaps bend and lie on others"
    )
    screw = "turn and slide on one axis, drawn into each other: they pass through each other, as a screw in its thread"
    for found, why in ((crossing, flaps), (sleeved, screw)):
        for a, b in found:
            loop.log.findings.append(warning(code="links_pass", message=f"'{a}' and '{b}' {why}", link=a))
    loop = replace(loop, overlay=overlay.model_copy(update={"passing": (*crossing, *sleeved)}))
    write_urdf(loop.extraction, loop.overlay, folder, loop.settings.physics)
    return loop


def cut_or_kept(loop: RefinementContext, folder: Folder, found: Pose) -> CutAttempt:
    """The attempt at this pose; where hulls must be cut anyway, that at the requested state if its Φ is as low."""
    best, requested = cut_attempt(loop, folder, found), loop.overlay.initial_positions
    if not best.changed or found == requested:
        return best
    kept = cut_attempt(loop, folder, requested)
    return kept if kept.phi <= max(best.phi, loop.settings.search.target_phi_m) else best


def write_best(loop: RefinementContext, folder: Folder, best: CutAttempt) -> RefinedState:
    """Write the folder at the best attempt, with a step and findings for what it changed."""
    log, requested, overlay = loop.log, loop.overlay.initial_positions, loop.overlay
    moved = moved_joints(best.positions, requested)
    if moved:
        overlay = at_positions(loop, best.positions, moved)
        log.findings.extend(move_findings(requested, moved, "they overlap less"))
    if best.changed:
        why = "collision shapes cut where no state near the requested one parts them"
        log.step(trace_step("shape", best.phi_before, best.phi, True, why, evaluations=2))
        note_cuts(best.cut, "where it overlaps", "in every state near the requested one", log)
    if loop.settings.collision.mode is not CollisionMode.KEEP:
        overlay, hulls = let_joints_move(loop, overlay, best.hulls)
        folder = folder if hulls is loop.hulls else replace_hulls(folder, hulls)
        folder = replace(folder, cuts=cuts_of(loop.hulls, hulls, log.planes))
    write_urdf(loop.extraction, overlay, folder, loop.settings.physics)
    return RefinedState(overlay, folder, tuple(log.trace), tuple(log.findings))


def search_state(
    loop: RefinementContext, folder: Folder, closed_tolerance: float, asked: QuestionContext | None = None
) -> Pose:
    """Pose near the requested one with the lowest Φ; the requested one where Φ in a fresh world is no lower.

    A joint at its closed end may move by ``closed_tolerance`` of its range. A model is asked if ``asked`` is given.
    """
    overlay, search, engine = loop.overlay, loop.settings.search, loop.settings.engine
    requested, joints = overlay.initial_positions, loop.extraction.features.joints
    bands = {joint.name: band_of(joint, search.state_tolerance, closed_tolerance) for joint in overlay.joints}
    acceptable = loop.settings.thresholds.penetration_m
    ask = None if asked is None else model_asker(asked)
    with static_object(folder.urdf, engine) as item:
        evaluator = Evaluator(lambda pose: contact_points(item, pose), search.max_evaluations)
        found, _, trace = refine_state(
            overlay.asset_id, joints, requested, bands, other_starts(overlay), evaluator, search, acceptable, ask
        )
    for step in trace:
        loop.log.step(step)
    return lower_in_fresh_world(loop, folder, found)


def model_state(loop: RefinementContext, folder: Folder, scene: QuestionContext) -> Pose:
    """Pose near the requested one to which a model's steps led, and a finding for how they ended; the requested one
    where Φ in a fresh world is no lower."""
    with static_object(folder.urdf, loop.settings.engine) as item:
        evaluator = Evaluator(lambda pose: contact_points(item, pose), loop.settings.search.max_evaluations)
        walk = refine_by_model(scene, evaluator)
    for step in walk.trace:
        loop.log.step(step)
    if walk.iterations:
        loop.log.findings.append(walk.finding)
    return lower_in_fresh_world(loop, folder, walk.pose)


def lower_in_fresh_world(loop: RefinementContext, folder: Folder, found: Pose) -> Pose:
    """The pose found, or the requested one where Φ in a fresh world is no lower."""
    requested, engine = loop.overlay.initial_positions, loop.settings.engine
    if found == requested:
        return requested
    # The search ran in one world, whose contact cache changes Φ a little; a fresh world decides.
    before, after = phi_at(folder.urdf, requested, engine), phi_at(folder.urdf, found, engine)
    return found if after < before else requested


def other_starts(overlay: PhysicsOverlay) -> Pose:
    """Joint → 0.0 for joints without a requested state that start elsewhere, where the limits contain zero."""
    return {
        joint.name: 0.0
        for joint in overlay.joints
        if joint.position_source is Source.RULE
        and joint.initial_position != 0.0
        and (joint.lower is None or joint.upper is None or joint.lower <= 0.0 <= joint.upper)
    }


def at_positions(loop: RefinementContext, found: Pose, moved: Mapping[str, float]) -> PhysicsOverlay:
    """The overlay validated again at these positions, with where each comes from."""
    overlay = loop.overlay
    again = loop.validated_at(overlay, found)
    before = {joint.name: joint for joint in overlay.joints}
    joints = (
        joint.model_copy(
            update={
                "initial_position": found[joint.name],
                "position_source": Source.SEARCH if joint.name in moved else before[joint.name].position_source,
                "asked_position": before[joint.name].asked_position,
            }
        )
        for joint in again.joints
    )
    return again.model_copy(update={"joints": tuple(joints)})
