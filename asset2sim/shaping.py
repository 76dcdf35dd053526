"""From a validated overlay to a judged folder, with collision shapes as finely cut as the asset stands."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

from asset2sim.apply import write_folder
from asset2sim.collision.shapes import collision_shapes
from asset2sim.extraction import Extraction
from asset2sim.judging import Judged, judge_and_mend
from asset2sim.search.asset import Refined, refine_in_engine
from asset2sim.search.loop import ModelAsk
from schemas.finding import Finding
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import CollisionMode, Severity, Source, Stage

DECOMPOSED = "collision_decomposed"
"""Code of the findings that tell of links cut into convex pieces."""

GOOD_PHI_M = 5e-4
"""Φ from which it is worth trying plain hulls, m: what the nine objects of the paper are to stay under."""

Timed = Callable[[Stage], AbstractContextManager[None]]
"""Adds the wall time of what runs within it to a stage."""


@dataclass(frozen=True)
class Job:
    """One asset on its way from overlay to verdict: ``path`` is the folder to write, ``cache`` holds convex pieces."""

    extraction: Extraction
    proposal: Overlay
    overlay: PhysicsOverlay
    source: Source
    path: Path
    cache: Path
    settings: Settings
    ask: ModelAsk
    timed: Timed


@dataclass(frozen=True)
class Shaped:
    """The folder's URDF as refined and judged, with everything there is to say of how."""

    urdf: Path
    refined: Refined
    judged: Judged
    findings: tuple[Finding, ...]


def shape_and_judge(job: Job) -> Shaped:
    """Write, refine, verify and mend; where convex pieces fail a test that plain hulls pass, it is hulls, and is told.

    Pieces keep hollows open and can pinch what moves between them; hulls fill hollows and pinch nothing.
    """
    shaped = attempt(job)
    cut = any(finding.code == DECOMPOSED for finding in shaped.findings)
    phi = largest_phi(shaped)
    if not cut or (shaped.judged.verdict.passed and phi <= GOOD_PHI_M):
        return shaped
    hulls = attempt(in_mode(job, CollisionMode.REPAIR))
    if hulls.judged.verdict.passed and not (shaped.judged.verdict.passed and phi <= largest_phi(hulls)):
        note = Finding(
            stage=Stage.MEASURE,
            severity=Severity.WARNING,
            code="collision_fallback",
            message="collision shapes are plain hulls, which fill hollows: with convex pieces "
            + (f"Φ is {1e3 * phi:.3g} mm" if shaped.judged.verdict.passed else shaped.judged.verdict.reason),
        )
        return replace(hulls, findings=(*hulls.findings, note))
    return attempt(job)


def largest_phi(shaped: Shaped) -> float:
    """The largest Φ in any engine, m."""
    seen = (report.measurement for report in shaped.judged.reports)
    return max((found.penetration_m for found in seen if found is not None), default=0.0)


def in_mode(job: Job, mode: CollisionMode) -> Job:
    """The same job with other collision geometry."""
    collision = job.settings.collision.model_copy(update={"mode": mode})
    return replace(job, settings=job.settings.model_copy(update={"collision": collision}))


def attempt(job: Job) -> Shaped:
    """One pass: collision shapes, folder, state, verification, mending."""
    with job.timed(Stage.APPLY):
        mode = job.settings.collision.mode
        hulls, told = collision_shapes(job.extraction, job.overlay.scale, job.settings.collision, job.cache)
        folder = write_folder(job.extraction, job.overlay, hulls, job.path, job.settings.physics, mode)
    with job.timed(Stage.REFINE):
        refined = refine_in_engine(
            job.extraction, job.proposal, job.overlay, job.source, hulls, folder, job.settings, job.ask
        )
    with job.timed(Stage.MEASURE):
        judged = judge_and_mend(job.extraction, refined.overlay, refined.folder, job.settings)
    return Shaped(refined.folder.urdf, refined, judged, told)
