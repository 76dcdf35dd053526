"""Context, log, trace steps and findings of one asset's refinement loop, joints moved and hulls cut among them."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

from asset2sim.assets.extract import Extraction
from asset2sim.assets.hulls import Hulls
from asset2sim.assets.urdf.document import known_robot
from asset2sim.assets.urdf.read import passing_pairs
from asset2sim.refinement.collision.trim import Cut, PlaneCut
from asset2sim.refinement.position_bands import Pose
from asset2sim.validation.validate import validate
from schemas.errors import first_words
from schemas.finding import Finding, TraceStep
from schemas.overlay import JointPhysics, LinkPhysics, Overlay, PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Severity, Source, Stage

info = partial(Finding, stage=Stage.REFINE, severity=Severity.INFO)
"""A finding of this stage that only informs ..."""
warning = partial(Finding, stage=Stage.REFINE, severity=Severity.WARNING)
"""... and one that warns."""


def trace_step(
    proposer: str,
    before_m: float,
    after_m: float,
    accepted: bool,
    reason: str,
    moved: Mapping[str, float] | None = None,
    evaluations: int = 1,
) -> TraceStep:
    """A step with Φ (m) before and after it; the log gives it its number."""
    return TraceStep(
        step=0, proposer=proposer, phi_before_m=before_m, phi_after_m=after_m, moved=dict(moved or {}),
        accepted=accepted, evaluations=evaluations, reason=reason,
    )  # fmt: skip


@dataclass
class Log:
    """Trace steps and findings of the loop, and every plane by which hulls were cut, those of other attempts too."""

    trace: list[TraceStep] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    planes: list[PlaneCut] = field(default_factory=list)

    def step(self, step: TraceStep) -> None:
        """Add a step under the next number."""
        self.trace.append(step.model_copy(update={"step": len(self.trace)}))


@dataclass(frozen=True)
class RefinementContext:
    """Inputs shared by all steps of one asset's loop; ``overlay`` holds the requested state, ``guidance`` the user's
    words."""

    extraction: Extraction
    proposal: Overlay
    overlay: PhysicsOverlay
    source: Source
    hulls: Hulls
    settings: Settings
    log: Log
    guidance: str | None = None

    @property
    def passing(self) -> tuple[tuple[str, str], ...]:
        """The pairs of links that the asset's URDF, or the overlay, lets pass through each other."""
        return (*passing_pairs(known_robot(self.extraction.urdf)), *self.overlay.passing)

    def validated_at(
        self, overlay: PhysicsOverlay, placed: Mapping[str, float], *, keep_terms: bool = True
    ) -> PhysicsOverlay:
        """The proposal validated again, with the overlay's support, contact friction and passing pairs and these joints
        (rad or m) placed: effective inertia and gravity load depend on positions. ``keep_terms``: whether the file's
        dynamics may stay."""
        made, _ = validate(
            self.extraction, self.proposal, self.source, overlay.contact_friction, self.settings.physics,
            overlay.support, placed=placed, keep_terms=keep_terms, contact_source=overlay.contact_source,
        )  # fmt: skip
        return made.model_copy(update={"passing": overlay.passing})


def move_findings(requested: Pose, moved: Mapping[str, float], why: str) -> list[Finding]:
    """A finding for every joint whose initial position differs from the requested one."""
    findings = []
    for name, value in moved.items():
        text = f"joint '{name}' starts at {value:.4g} in place of {requested[name]:.4g}: {why}"
        findings.append(info(code="state_moved", message=text, joint=name, value=value, limit=requested[name]))
    return findings


def note_cuts(cuts: Sequence[Cut], where: str, when: str, log: Log) -> None:
    """A finding for every link whose collision hulls were cut, with the links it overlapped."""
    for link in sorted({cut.link for cut in cuts}):
        own = [cut for cut in cuts if cut.link == link]
        deepest = max(own, key=lambda cut: cut.depth_m)
        others = first_words(list(dict.fromkeys(f"'{cut.other}'" for cut in own)), 4)
        text = (
            f"collision of link '{link}' cut by up to {1e3 * deepest.depth_m:.3g} mm ({deepest.share:.0%} of a hull) "
            f"{where} {others} {when}; its looks are unchanged"
        )
        log.findings.append(warning(code="collision_cut", message=text, link=link, value=deepest.depth_m))


JOINT_TERMS = {"damping": ("N·m·s/rad", "N·s/m"), "friction": ("N·m", "N"), "stiffness": ("N·m/rad", "N/m")}
"""Joint terms that mending may change → units for hinges and sliders."""
mended = partial(info, code="mended")
"""A finding for one number that mending changed: ``value`` from ``limit``."""


def changed_numbers(before: PhysicsOverlay, after: PhysicsOverlay, why: str) -> Iterator[Finding]:
    """A finding for every number that differs; ``why`` names the check that failed before."""
    was, now = before.rolling_friction_m, after.rolling_friction_m
    if was != now:
        text = f"rolling resistance of contacts set from {1e3 * was:.3g} to {1e3 * now:.3g} mm: {why}"
        yield mended(message=text, value=now, limit=was)
    if before.turned_rad != after.turned_rad:
        angle = math.degrees(math.dist(after.turned_rad, before.turned_rad))
        yield mended(message=f"the object turned by {angle:.3g}°, to lie as it comes to rest: {why}", value=angle)
    for old_link, link in zip(before.links, after.links, strict=True):
        yield from _link(old_link, link, why)
    for old_joint, joint in zip(before.joints, after.joints, strict=True):
        yield from _joint(old_joint, joint, why)


def _link(old: LinkPhysics, new: LinkPhysics, why: str) -> Iterator[Finding]:
    if old.mass_kg != new.mass_kg:
        text = f"mass of link '{new.name}' raised from {old.mass_kg:.3g} to {new.mass_kg:.3g} kg: {why}"
        yield mended(message=text, value=new.mass_kg, limit=old.mass_kg, link=new.name)


def _joint(old: JointPhysics, new: JointPhysics, why: str) -> Iterator[Finding]:
    for term, units in JOINT_TERMS.items():
        was, now = float(getattr(old, term)), float(getattr(new, term))
        if was != now:
            unit = units[new.type == "prismatic"]
            text = f"joint '{new.name}': {term} set from {was:.3g} to {now:.3g} {unit}: {why}"
            yield mended(message=text, value=now, limit=was, joint=new.name)
