"""Refine one asset in PyBullet: the search over its state, a model where the search fails, then its collision shapes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from asset2sim.apply import Folder, with_hulls, write_urdf
from asset2sim.collision.hulls import Hulls
from asset2sim.collision.trim import contact_pairs
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
from schemas.settings import Settings
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
    log = Log()
    requested = overlay.initial_positions
    found = search_state(extraction, overlay, requested, folder, settings, ask, log)
    moved = {name: value for name, value in found.items() if value != requested[name]}
    if moved:
        overlay = at_positions(extraction, proposal, overlay, found, moved, source, settings)
        note_moves(overlay, requested, moved, log)
    folder = clear_shapes(extraction, overlay, hulls, folder, settings, log)
    return Refined(overlay, folder, tuple(log.trace), tuple(log.calls), tuple(log.findings))


def search_state(
    extraction: Extraction,
    overlay: PhysicsOverlay,
    requested: Pose,
    folder: Folder,
    settings: Settings,
    ask: ModelAsk,
    log: Log,
) -> Pose:
    """The pose with the lowest Φ near the requested one; the requested one where a fresh world sees no fall of Φ."""
    bands = {joint.name: band_of(joint, settings.search.state_tolerance) for joint in overlay.joints}
    with penetration_probe(folder.urdf, settings.engine) as item:
        evaluator = Evaluator(lambda pose: contact_points(item, pose), settings.search.max_evaluations)
        found, _, trace = refine_state(
            overlay.asset_id,
            extraction.features.joints,
            requested,
            bands,
            alternatives(overlay),
            evaluator,
            settings.search,
            settings.thresholds.penetration_m,
            model_asker(extraction, overlay, folder.urdf, settings, ask, log),
        )
    for step in trace:
        log.step(step)
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


def note_moves(overlay: PhysicsOverlay, requested: Pose, moved: Mapping[str, float], log: Log) -> None:
    """A finding for every joint that starts elsewhere than was asked or assumed."""
    for name, value in moved.items():
        log.findings.append(
            Finding(
                stage=Stage.REFINE, severity=Severity.INFO, code="state_moved",
                message=f"joint '{name}' starts at {value:.4g} in place of {requested[name]:.4g}, where links overlap less",
                joint=name, value=value, limit=requested[name],
            )  # fmt: skip
        )


def clear_shapes(
    extraction: Extraction,
    overlay: PhysicsOverlay,
    hulls: Hulls,
    folder: Folder,
    settings: Settings,
    log: Log,
) -> Folder:
    """Cut away what still overlaps in the found state, kept only if a fresh world then sees Φ fall."""
    positions = overlay.initial_positions
    before = penetration(contacts_at(folder.urdf, positions, settings.engine))
    if before <= settings.search.target_phi_m:
        return folder
    features = extraction.features
    poses = link_to_root(tree_of(written_joints(features, overlay), overlay.scale), features.root, positions)
    trimmed, cuts = cleared(hulls, poses, contact_pairs(features.joints, [link.name for link in features.links]))
    if not cuts:
        return folder
    changed = with_hulls(folder, trimmed)
    write_urdf(extraction, overlay, changed, settings.physics)
    after = penetration(contacts_at(changed.urdf, positions, settings.engine))
    accepted = after < before
    log.step(
        TraceStep(
            step=0, proposer="shape", phi_before_m=before, phi_after_m=after, moved={}, accepted=accepted, evaluations=2,
            reason=f"{len(cuts)} collision shapes cut where no state near the requested one parts them",
        )  # fmt: skip
    )
    if not accepted:
        restored = with_hulls(folder, hulls)
        write_urdf(extraction, overlay, restored, settings.physics)
        return restored
    for cut in cuts:
        log.findings.append(
            Finding(
                stage=Stage.REFINE, severity=Severity.WARNING, code="collision_cut",
                message=f"collision of link '{cut.link}' cut by up to {1e3 * cut.depth_m:.3g} mm ({cut.share:.0%} of a hull) "
                f"where it overlaps '{cut.other}' in every state near the requested one; its looks are unchanged",
                link=cut.link, value=cut.depth_m,
            )  # fmt: skip
        )
    return changed


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


def band_of(joint: JointPhysics, tolerance: float) -> Band:
    """Where a joint may go without leaving its state: ``tolerance`` of its range to either side, within its limits."""
    position = joint.initial_position
    if joint.lower is None or joint.upper is None:
        return Band(position, position - tolerance, position + tolerance, 1.0)
    reach = tolerance * (joint.upper - joint.lower)
    low, high = max(joint.lower, position - reach), min(joint.upper, position + reach)
    return Band(position, low, high, joint.upper - joint.lower)


def model_asker(
    extraction: Extraction,
    overlay: PhysicsOverlay,
    urdf: Path,
    settings: Settings,
    ask: ModelAsk,
    log: Log,
) -> Ask:
    """What asks the model for a step: four views for models that may look, the pairs, the focus joints, the desired state."""

    def propose(best: Pose, phi: float, pairs: tuple[ContactPair, ...], focus: tuple[str, ...]) -> Pose | None:
        images: tuple[LabelledImage, ...] = ()
        if not settings.model.model.startswith("prior/"):
            views = render_views(urdf, best, settings.views)
            images = tuple(LabelledImage(label=name, png=png_bytes(views[name])) for name in MODEL_VIEWS)
        request = refinement_request(
            extraction.features, overlay, phi, pairs, best, overlay.initial_positions, focus, images
        )
        answer = ask(request)
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
