"""Asking a model for a step of the state (paper, "Refine the state")."""

from pathlib import Path

from asset2sim.models.answers import parse_refinement
from asset2sim.models.priors_known import is_prior
from asset2sim.models.prompt import refinement_request
from asset2sim.search.loop import Loop
from asset2sim.search.proposals import Pose
from asset2sim.search.refine import Ask
from asset2sim.views import png_bytes, render_views
from schemas.errors import InvalidAnswerError
from schemas.finding import Finding
from schemas.measurement import ContactPair
from schemas.request import LabelledImage
from schemas.vocabulary import Severity, Stage

MODEL_VIEWS = ("front", "left", "right", "perspective")
"""The four views of the state that a model is shown (paper, "Refine the state")."""


def model_asker(loop: Loop, urdf: Path) -> Ask:
    """What asks the model for a step: four views for models that may look, the pairs, the focus joints, the
    desired state."""
    settings, log = loop.settings, loop.log

    def propose(best: Pose, phi: float, pairs: tuple[ContactPair, ...], focus: tuple[str, ...]) -> Pose | None:
        images: tuple[LabelledImage, ...] = ()
        if not is_prior(settings.model.model):
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
        stage=Stage.REFINE,
        severity=Severity.WARNING,
        code="refinement_unanswered",
        message=f"no step from the model: {problem}",
    )
