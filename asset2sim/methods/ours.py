"""Asset2Sim: a model proposes, rules complete and bound, a search and a simulator decide."""

from pathlib import Path

from asset2sim.asset_progress import Progress
from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import staged_folder
from asset2sim.assets.meshes.shape_cache import PIECES
from asset2sim.assets.views.canonical import labelled_views
from asset2sim.checks.verdict import Verdict
from asset2sim.models.ask_overlay import synthesize
from asset2sim.publishing import publish
from asset2sim.refinement.refine import Job, shape_and_judge
from asset2sim.validation import validate
from asset2sim.validation.sanity import sensible
from asset2sim.validation.validate import contact_friction
from schemas.asset import AssetRef
from schemas.model_names import is_prior
from schemas.request import ModelAsk
from schemas.settings import Settings
from schemas.vocabulary import Method, Source, Stage


def refine_with_rules(
    ref: AssetRef, extraction: Extraction, out: Path, settings: Settings, ask: ModelAsk, progress: Progress
) -> Verdict:
    """Synthesize, validate, apply, refine, measure and publish one asset; raises AssetError where it cannot go on."""
    with progress.timed(Stage.SYNTHESIZE):
        images = tuple(labelled_views(extraction, settings).values())
        proposal, calls, findings = synthesize(
            extraction.features, ref.prompt, extraction.closed_size, extraction.link_centers, ask, images
        )
        progress.calls.extend(calls)
        progress.findings.extend(findings)
        semantic = settings.method is not Method.NO_SEMANTICS
        proposal, findings = sensible(extraction, proposal, ref.prompt, settings.physics, semantics=semantic)
        progress.findings.extend(findings)
    source = Source.PRIOR if is_prior(settings.model.model) else Source.MODEL
    with progress.timed(Stage.VALIDATE):
        friction = contact_friction(proposal.contact_material, settings.physics)
        overlay, findings = validate(extraction, proposal, source, friction, settings.physics)
        progress.overlay = overlay
        progress.findings.extend(findings)
    with staged_folder(out / "assets" / ref.asset_id) as path:
        job = Job(extraction, proposal, overlay, source, path, out / PIECES, settings, ask, progress.timed)
        shaped = shape_and_judge(job)
        progress.refined(shaped)
        with progress.timed(Stage.PUBLISH):
            progress.overlay, told = publish(shaped.urdf, shaped.judged, settings)
            progress.findings.extend(told)
    return shaped.judged.verdict
