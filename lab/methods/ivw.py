"""VLM-IVW: ask about every view several times and fuse the answers by inverse variance (paper, baselines)."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import DASHED, DeclaredMethod, ProposalJob, Proposed
from asset2sim.baselines.ours import told_overlaps
from asset2sim.models.answers import parse_overlay
from asset2sim.models.ask_overlay import SynthesisError, Synthesized, images_not_sent, marked_invalid
from asset2sim.models.prompts import IVW, overlay_request
from asset2sim.render import VIEW_NAMES
from asset2sim.render.marked import question_pictures
from lab.methods.fusion import fuse
from schemas.errors import InvalidAnswerError, first_words
from schemas.features import Features, RestOverlap
from schemas.finding import Finding
from schemas.overlay import Overlay
from schemas.request import LabelledImage, ModelAnswer, ModelAsk, ModelCall, ModelRequest
from schemas.settings import MethodSettings
from schemas.vocabulary import FailureMode, Method, Severity, Stage

LEAST_SHARE = 0.5
"""Least share of the answers that must be valid: fewer would fuse a minority."""
MAX_REASONS = 3
"""Reasons that a message about dropped answers lists."""


@dataclass
class Answers:
    """Valid answers, calls and findings so far, the reason for each call without a valid answer, and the number of
    calls with an answer, valid or not."""

    valid: list[Overlay] = field(default_factory=list)
    calls: list[ModelCall] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    answered: int = 0


def ask_fused(
    extraction: Extraction,
    guidance: str | None,
    ask: ModelAsk,
    images: Sequence[LabelledImage],
    settings: MethodSettings,
    overlaps: Sequence[RestOverlap] = (),
) -> Synthesized:
    """Fused answer to ``ivw_queries`` questions about each view, all calls, and findings for dropped answers.

    ``images`` are the object's looks, labelled with their views, and what every question shows; there may be none. An
    invalid answer is dropped, without a second try. Asking
    stops when half of the answers can no longer be valid, or a budget is spent. Raises ``SynthesisError``:
    ``budget``, ``model_error`` where no call was answered, else ``no_valid_estimate``.
    """
    wanted = len(VIEW_NAMES) * settings.ivw_queries
    needed = LEAST_SHARE * wanted
    got, spent = Answers(), False
    for request in requests(extraction, guidance, images, settings.ivw_queries, overlaps):
        answer = ask(request)
        take(answer, extraction, got)
        spent = answer.budget_spent
        if spent or wanted - len(got.reasons) < needed:
            break
    if len(got.valid) < needed:
        raise too_few(got, wanted, spent)
    if got.reasons:
        got.findings.append(dropped(got, wanted))
    try:
        return fuse(got.valid), tuple(got.calls), tuple(got.findings)
    except ValueError as error:
        told = f"the answers have no common value: {error}"
        raise SynthesisError(FailureMode.NO_VALID_ESTIMATE, "no_fusion", told, got.calls) from None


def requests(
    extraction: Extraction,
    guidance: str | None,
    images: Sequence[LabelledImage],
    queries: int,
    overlaps: Sequence[RestOverlap],
) -> Iterator[ModelRequest]:
    """Every question in turn, view by view; ``sample`` numbers them all from 1. Each shows one look, and the pictures
    that mark the links."""
    sample = itertools.count(1)
    for view in VIEW_NAMES:
        shown = [image for image in images if image.label == view or image.label not in VIEW_NAMES]
        request = overlay_request(IVW, extraction.features, guidance, shown, view, overlaps)
        for _ in range(queries):
            yield request.model_copy(update={"sample": next(sample)})


def take(answer: ModelAnswer, extraction: Extraction, got: Answers) -> None:
    """Add one answer to ``got``, or the reason why it is invalid."""
    if not got.findings:
        got.findings.extend(images_not_sent(answer))
    if answer.content is None:
        got.calls.extend(answer.calls)
        got.reasons.append(answer.error or "the model failed")
        return
    got.answered += 1
    try:
        got.valid.append(within_limits(parse_overlay(answer.content, extraction.features), extraction.features))
        got.calls.extend(answer.calls)
    except InvalidAnswerError as error:
        got.calls.extend(marked_invalid(answer.calls))
        got.reasons.append(str(error))


def within_limits(answer: Overlay, features: Features) -> Overlay:
    """The answer with joint positions clamped to the authored limits (rad, m at scale 1).

    The weighted mean does not reject outliers: of 25 answers, one in degrees would turn a lid several times.
    """
    held = {}
    for name, position in answer.initial_joint_positions.items():
        joint = features.joint(name)
        if joint.lower is not None and joint.upper is not None:
            low, high = sorted((joint.lower, joint.upper))
            position = min(max(position, low), high)
        held[name] = position
    return answer.model_copy(update={"initial_joint_positions": held})


def dropped(got: Answers, wanted: int) -> Finding:
    """Finding with the number of answers that were not fused."""
    count = len(got.reasons)
    return Finding(
        stage=Stage.SYNTHESIZE, severity=Severity.WARNING, code="answers_dropped", value=float(count),
        message=f"{len(got.valid)} answers of {wanted} wanted are fused, {count} dropped: {reasons_of(got)}",
    )  # fmt: skip


def too_few(got: Answers, wanted: int, spent: bool) -> SynthesisError:
    """Error for too few valid answers to fuse."""
    told = f"{len(got.valid)} valid answers of {wanted} wanted, and half are needed: {reasons_of(got)}"
    if spent:
        return SynthesisError(FailureMode.BUDGET, "budget_spent", told, got.calls)
    if got.answered == 0:
        return SynthesisError(FailureMode.MODEL_ERROR, "model_error", told, got.calls)
    return SynthesisError(FailureMode.NO_VALID_ESTIMATE, "invalid_answers", told, got.calls)


def reasons_of(got: Answers) -> str:
    """The first few distinct reasons, as text."""
    return first_words(dict.fromkeys(got.reasons), MAX_REASONS, "; ")


def propose(job: ProposalJob, extraction: Extraction) -> Proposed:
    """Several answers to each view, fused. Raises SynthesisError."""
    images = question_pictures(extraction, job.settings, views=VIEW_NAMES)
    overlaps = told_overlaps(job, extraction)
    return ask_fused(extraction, job.ref.prompt, job.ask, images, job.settings.methods, overlaps)


METHOD = DeclaredMethod(
    Method.IVW,
    "VLM-IVW",
    "25 answers, weighted by inverse variance",
    propose,
    place=20,
    colour="#E69F00",
    dashes=DASHED,
)
