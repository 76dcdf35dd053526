"""Refine one asset in PyBullet: the search over its state, a model where the search fails, then its collision shapes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from asset2sim.apply import Folder, with_hulls, write_urdf
from asset2sim.collision.hulls import Hulls
from asset2sim.collision.trim import Cut, contact_pairs
from asset2sim.engines.pybullet_overlaps import cleared
from asset2sim.engines.pybullet_penetration import contact_points, contacts_at, penetration_probe
from asset2sim.extraction import Extraction
from asset2sim.kinematics import link_to_root, tree_of
from asset2sim.metrics.penetration import penetration
from asset2sim.models.answers import parse_refinement
from asset2sim.models.prompt import refinement_request
from asset2sim.search.proposals import Pose
from asset2sim.search.refine import Ask, refine_state
from asset2sim.search.state import Band, Evaluator
from asset2sim.validation import validate
from asset2sim.views import png_bytes, render_views
from schemas.call import ModelCall
from schemas.errors import InvalidAnswerError
from schemas.features import Features, JointFeatures
from schemas.finding import Finding
from schemas.measurement import ContactPair
from schemas.overlay import JointPhysics, Overlay, PhysicsOverlay
from schemas.request import LabelledImage, ModelAnswer, ModelRequest
from schemas.settings import SearchSettings, Settings
from schemas.trace import TraceStep
from schemas.vocabulary import Severity, Source, Stage

ModelAsk = Callable[[ModelRequest], ModelAnswer]

MODEL_VIEWS = ("front", "left", "right", "perspective")
"""The four views of the state that a model is shown (paper, "Refine the state")."""


@dataclass(frozen=True)
class Refined:
    """The overlay at the state that was found, the folder with the collision shapes it needs, and how they were found."""

    overlay: PhysicsOverlay
    folder: Folder
    trace: tuple[TraceStep, ...]
    calls: tuple[ModelCall, ...]
    findings: tuple[Finding, ...]


@dataclass
class Log:
    """What the loop leaves behind as it goes."""

    trace: list[TraceStep] = field(default_factory=list)
    calls: list[ModelCall] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def step(self, step: TraceStep) -> None:
        """Add a step under the next number."""
        self.trace.append(step.model_copy(update={"step": len(self.trace)}))


def refine_in_engine(
    extraction: Extraction,
    proposal: Overlay,
    overlay: PhysicsOverlay,
    source: Source,
    hulls: Hulls,
    folder: Folder,
    settings: Settings,
    ask: ModelAsk,
) -> Refined:
    """Lower Φ: first by state, near the requested one; then, where no state helps, by collision shape.

    Joint dynamics are derived anew where the state moved.
    """
    loop = Loop(extraction, proposal, overlay, source, hulls, settings, ask, Log())
    requested = overlay.initial_positions
    found = search_state(loop, folder, asking=False)
    attempts = [found] if found == requested else [found, requested]
    best = attempt(loop, folder, found)
    # Where shapes must be cut anyway, the requested state is not left for nothing.
    if best.cut and found != requested:
        kept = attempt(loop, folder, requested)
        best = kept if kept.phi <= max(best.phi, settings.search.target_phi_m) else best
    if best.phi > settings.thresholds.penetration_m:
        asked = search_state(loop, folder, asking=True)
        if asked not in attempts:
            again = attempt(loop, folder, asked)
            best = again if again.phi < best.phi else best
    return settled(loop, folder, best)


@dataclass(frozen=True)
class Loop:
    """What every step of one asset's loop needs; ``overlay`` is the one that asks for the state."""

    extraction: Extraction
    proposal: Overlay
    overlay: PhysicsOverlay
    source: Source
    hulls: Hulls
    settings: Settings
    ask: ModelAsk
    log: Log


@dataclass(frozen=True)
class Attempt:
    """A state with the collision shapes cut for it: Φ (m) in a fresh world before and after, and what was cut."""

    positions: Pose
    hulls: Hulls
    phi_before: float
    phi: float
    cut: tuple[Cut, ...]


def attempt(loop: Loop, folder: Folder, positions: Pose) -> Attempt:
    """Cut what overlaps at these positions, if anything does; the folder is left with the shapes as they were."""
    before = penetration(contacts_at(folder.urdf, positions, loop.settings.engine))
    if before <= loop.settings.search.target_phi_m:
        return Attempt(positions, loop.hulls, before, before, ())
    features, overlay = loop.extraction.features, loop.overlay
    poses = link_to_root(tree_of(written_joints(features, overlay), overlay.scale), features.root, positions)
    links = [link.name for link in features.links]
    trimmed, cuts = cleared(loop.hulls, poses, contact_pairs(features.joints, links))
    if not cuts:
        return Attempt(positions, loop.hulls, before, before, ())
    write_urdf(loop.extraction, overlay, with_hulls(folder, trimmed), loop.settings.physics)
    after = penetration(contacts_at(folder.urdf, positions, loop.settings.engine))
    write_urdf(loop.extraction, overlay, with_hulls(folder, loop.hulls), loop.settings.physics)
    if after >= before:
        return Attempt(positions, loop.hulls, before, before, ())
    return Attempt(positions, trimmed, before, after, cuts)


def settled(loop: Loop, folder: Folder, best: Attempt) -> Refined:
    """Write the folder at the best attempt, with a step and findings for what it changed."""
    log, requested, overlay = loop.log, loop.overlay.initial_positions, loop.overlay
    moved = {name: value for name, value in best.positions.items() if value != requested[name]}
    if moved:
        overlay = at_positions(loop.extraction, loop.proposal, overlay, best.positions, moved, loop.source, loop.settings)
        note_moves(requested, moved, log)
    if best.cut:
        log.step(
            TraceStep(
                step=0, proposer="shape", phi_before_m=best.phi_before, phi_after_m=best.phi, moved={}, accepted=True,
                evaluations=2, reason="collision shapes cut where no state near the requested one parts them",
            )  # fmt: skip
        )
        folder = with_hulls(folder, best.hulls)
        note_cuts(best.cut, log)
    write_urdf(loop.extraction, overlay, folder, loop.settings.physics)
    return Refined(overlay, folder, tuple(log.trace), tuple(log.calls), tuple(log.findings))


def search_state(loop: Loop, folder: Folder, asking: bool) -> Pose:
    """The pose with the lowest Φ near the requested one; the requested one where a fresh world sees no fall of Φ.

    The model is asked only if ``asking``.
    """
    overlay, settings = loop.overlay, loop.settings
    requested = overlay.initial_positions
    bands = {joint.name: band_of(joint, settings.search) for joint in overlay.joints}
    with penetration_probe(folder.urdf, settings.engine) as item:
        evaluator = Evaluator(lambda pose: contact_points(item, pose), settings.search.max_evaluations)
        found, _, trace = refine_state(
            overlay.asset_id,
            loop.extraction.features.joints,
            requested,
            bands,
            alternatives(overlay),
            evaluator,
            settings.search,
            settings.thresholds.penetration_m,
            model_asker(loop, folder.urdf) if asking else None,
        )
    for step in trace:
        loop.log.step(step)
    if found == requested:
        return requested
    # The search ran in one world whose contact cache remembers; the judge is a fresh one.
    before = penetration(contacts_at(folder.urdf, requested, settings.engine))
    after = penetration(contacts_at(folder.urdf, found, settings.engine))
    return found if after < before else requested


def alternatives(overlay: PhysicsOverlay) -> Pose:
    """The authored zero of every joint for which nobody asked a state and which starts elsewhere, within its limits."""
    return {
        joint.name: 0.0
        for joint in overlay.joints
        if joint.position_source is Source.RULE
        and joint.initial_position != 0.0
        and (joint.lower is None or joint.upper is None or joint.lower <= 0.0 <= joint.upper)
    }


def note_moves(requested: Pose, moved: Mapping[str, float], log: Log) -> None:
    """A finding for every joint that starts elsewhere than was asked or assumed."""
    for name, value in moved.items():
        log.findings.append(
            Finding(
                stage=Stage.REFINE, severity=Severity.INFO, code="state_moved",
                message=f"joint '{name}' starts at {value:.4g} in place of {requested[name]:.4g}, where links overlap less",
                joint=name, value=value, limit=requested[name],
            )  # fmt: skip
        )


def note_cuts(cuts: Sequence[Cut], log: Log) -> None:
    """A finding for every link that lost part of its collision shape: its deepest cut, and the links it was cleared of."""
    for link in sorted({cut.link for cut in cuts}):
        own = [cut for cut in cuts if cut.link == link]
        deepest = max(own, key=lambda cut: cut.depth_m)
        others = ", ".join(f"'{cut.other}'" for cut in own[:4]) + (f" and {len(own) - 4} more" if len(own) > 4 else "")
        log.findings.append(
            Finding(
                stage=Stage.REFINE, severity=Severity.WARNING, code="collision_cut",
                message=f"collision of link '{link}' cut by up to {1e3 * deepest.depth_m:.3g} mm ({deepest.share:.0%} of a hull) "
                f"where it overlaps {others} in every state near the requested one; its looks are unchanged",
                link=link, value=deepest.depth_m,
            )  # fmt: skip
        )


def at_positions(
    extraction: Extraction,
    proposal: Overlay,
    overlay: PhysicsOverlay,
    found: Pose,
    moved: Mapping[str, float],
    source: Source,
    settings: Settings,
) -> PhysicsOverlay:
    """The overlay validated at the found positions: what a joint moves and must hold depends on where it is."""
    sliders = {joint.name for joint in overlay.joints if joint.type == "prismatic"}
    authored = {name: value / overlay.scale if name in sliders else value for name, value in found.items()}
    again, _ = validate(
        extraction,
        proposal.model_copy(update={"initial_joint_positions": authored}),
        source,
        overlay.contact_friction,
        settings.physics,
    )
    sources = {joint.name: joint.position_source for joint in overlay.joints}
    joints = tuple(
        joint.model_copy(
            update={
                "initial_position": found[joint.name],
                "position_source": Source.SEARCH if joint.name in moved else sources[joint.name],
            }
        )
        for joint in again.joints
    )
    return again.model_copy(update={"joints": joints})


def band_of(joint: JointPhysics, settings: SearchSettings) -> Band:
    """Where a joint may go without leaving its state: a share of its range to either side, within its limits."""
    position = joint.initial_position
    if joint.lower is None or joint.upper is None:
        return Band(position, position - settings.state_tolerance, position + settings.state_tolerance, 1.0)
    span = joint.upper - joint.lower
    closed = abs(position - joint.closed) <= settings.closed_tolerance * span
    reach = span * (settings.closed_tolerance if closed else settings.state_tolerance)
    return Band(position, max(joint.lower, position - reach), min(joint.upper, position + reach), span)


def model_asker(loop: Loop, urdf: Path) -> Ask:
    """What asks the model for a step: four views for models that may look, the pairs, the focus joints, the desired state."""
    settings, log = loop.settings, loop.log

    def propose(best: Pose, phi: float, pairs: tuple[ContactPair, ...], focus: tuple[str, ...]) -> Pose | None:
        images: tuple[LabelledImage, ...] = ()
        if not settings.model.model.startswith("prior/"):
            views = render_views(urdf, best, settings.views)
            images = tuple(LabelledImage(label=name, png=png_bytes(views[name])) for name in MODEL_VIEWS)
        request = refinement_request(
            loop.extraction.features, loop.overlay, phi, pairs, best, loop.overlay.initial_positions, focus, images
        )
        answer = loop.ask(request)
        log.calls.extend(answer.calls)
        if answer.content is None:
            log.findings.append(unanswered(answer.error or "the model failed"))
            return None
        try:
            step = parse_refinement(answer.content, focus)
        except InvalidAnswerError as error:
            log.findings.append(unanswered(str(error)))
            return None
        return None if step.approved else {name: best[name] + delta for name, delta in step.deltas.items()}

    return propose


def unanswered(problem: str) -> Finding:
    """A finding for a refinement call that brought nothing; the search goes on without it."""
    return Finding(
        stage=Stage.REFINE, severity=Severity.WARNING, code="refinement_unanswered", message=f"no step from the model: {problem}"
    )


def written_joints(features: Features, overlay: PhysicsOverlay) -> list[JointFeatures]:
    """The joints as they are written: those that validation locked are fixed."""
    kept = {joint.name for joint in overlay.joints}
    return [
        joint if joint.name in kept or not joint.movable else joint.model_copy(update={"type": "fixed"})
        for joint in features.joints
    ]
