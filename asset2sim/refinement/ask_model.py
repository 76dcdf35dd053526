"""Model questions about one asset's state: each asked once, and once more where the answer is invalid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from asset2sim.models.answers import RefinementAnswer, parse_refinement
from asset2sim.models.ask_overlay import MAX_ASKS, ask_until_valid, images_not_sent
from asset2sim.models.prompts import StateProblem, TriedProposal, refinement_request
from asset2sim.refinement.context import warning
from asset2sim.refinement.locate_overlaps import locate_overlaps
from asset2sim.refinement.position_bands import Band, Pose
from asset2sim.refinement.search_state import Ask
from asset2sim.render import png_bytes, render_views
from schemas.errors import AssetError
from schemas.features import Features
from schemas.finding import Finding
from schemas.model_names import REFINEMENT_PURPOSE, is_local, model_for
from schemas.overlay import PhysicsOverlay
from schemas.request import LabelledImage, ModelAnswer, ModelAsk, ModelCall, ModelRequest
from schemas.settings import Settings
from schemas.vocabulary import Stage


@dataclass
class AskedSoFar:
    """The asker, the calls left, and the calls, findings and answers so far, shared by all attempts at an asset: a
    repeated question gets the same answer, and the calls of a dropped attempt still count. ``wanted``: some question
    came up, whether or not it could be asked."""

    ask: ModelAsk
    left: int
    calls: list[ModelCall] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    known: dict[str, RefinementAnswer | str] = field(default_factory=dict)
    wanted: bool = False

    def answer(self, request: ModelRequest, focus: tuple[str, ...]) -> RefinementAnswer | str:
        """The model's step of the focus joints, or why there is none. An invalid answer does not raise."""
        self.wanted = True
        if request.text not in self.known:
            self.known[request.text] = self._ask(request, focus)
        return self.known[request.text]

    def _ask(self, request: ModelRequest, focus: tuple[str, ...]) -> RefinementAnswer | str:
        said = ask_until_valid(request, self.ask, lambda text: parse_refinement(text, focus), min(self.left, MAX_ASKS))
        self.left -= len(said.answers)
        self.calls.extend(said.calls)
        if not said.answers:
            return "no model call is left"
        self._note_images(said.answers[0])
        if len(said.answers) > 1:
            self._note("invalid_answer", f"the model's step was refused and it was asked again: {said.refused[0]}")
        if said.value is not None:
            return said.value
        if said.answers[-1].content is None:
            return self._give_up(said.answers[-1])
        self._note("refinement_unanswered", f"the search goes on without a step from the model: {said.refused[-1]}")
        return f"no answer of the model fits: {said.refused[-1]}"

    def _give_up(self, answer: ModelAnswer) -> str:
        """Ask no more, and say why: the budget is spent, or the provider failed in all its attempts."""
        self.left = 0
        code = "budget_spent" if answer.budget_spent else "refinement_unanswered"
        why = answer.error or ("the budget is spent" if answer.budget_spent else "the model failed")
        self._note(code, f"the search goes on without the model: {why}")
        return why

    def _note_images(self, answer: ModelAnswer) -> None:
        if all(finding.code != "images_not_sent" for finding in self.findings):
            self.findings.extend(f.model_copy(update={"stage": Stage.REFINE}) for f in images_not_sent(answer))

    def _note(self, code: str, message: str) -> None:
        self.findings.append(warning(code=code, message=message))


MODEL_VIEWS = ("perspective", "front", "right", "top")
"""The four views of the state that a model is shown: perspective, front, side and top (paper, "Refine the state")."""


@dataclass(frozen=True)
class QuestionContext:
    """Inputs shared by all questions about one asset: the overlay with the requested state, the URDF to render, each
    joint's allowed band (rad or m), the questions asked so far, and the user's words."""

    features: Features
    overlay: PhysicsOverlay
    settings: Settings
    urdf: Path
    reach: Mapping[str, Band]
    questions: AskedSoFar
    guidance: str | None = None

    def overlap(self, pose: Pose, tried: Sequence[TriedProposal], solved: Sequence[tuple[str, str]]) -> StateProblem:
        """The problem of links that overlap at a pose, with where they do, as a fresh world has it."""
        found = locate_overlaps(self.features, self.overlay, self.urdf, pose, self.settings.engine)
        return StateProblem(pose, found.phi_m, found.pairs, tuple(tried), found.places, tuple(solved))


@dataclass(frozen=True)
class ProposedPose:
    """The pose that a model proposes, every joint within its reach; None without one, ``reason`` saying why, and
    ``approved`` where the model takes the present state for good. ``answered``: whether there was a valid answer."""

    pose: Pose | None
    reason: str = ""
    approved: bool = False
    answered: bool = True


def model_asker(scene: QuestionContext) -> Ask:
    """Callback that asks the model for a step while links overlap."""

    def propose(best: Pose, focus: tuple[str, ...], tried: tuple[TriedProposal, ...]) -> Pose | None:
        return propose_pose(scene, scene.overlap(best, tried, ()), focus).pose

    return propose


def propose_pose(scene: QuestionContext, situation: StateProblem, focus: tuple[str, ...]) -> ProposedPose:
    """The model's proposal for the focus joints."""
    present = situation.positions
    reach = {name: (scene.reach[name].low, scene.reach[name].high) for name in focus}
    views = model_views(scene, present)
    request = refinement_request(scene.features, scene.overlay, situation, focus, reach, views, scene.guidance)
    step = scene.questions.answer(request, focus)
    if isinstance(step, str):
        return ProposedPose(None, step, answered=False)
    if step.approved:
        return ProposedPose(None, "the model approves the state", approved=True)
    pose = {**present, **{name: scene.reach[name].clamp(present[name] + d) for name, d in step.deltas.items()}}
    if pose != present:
        return ProposedPose(pose)
    kept = any(step.deltas.values())
    return ProposedPose(None, "the step leads beyond the requested state" if kept else "the model proposes no step")


def model_views(scene: QuestionContext, pose: Pose) -> Sequence[LabelledImage]:
    """Four labelled views of a pose; none for a model of tables or files, or where no model call is left."""
    if is_local(model_for(scene.settings.model, REFINEMENT_PURPOSE)) or scene.questions.left <= 0:
        return ()
    try:
        views = render_views(scene.urdf, pose, scene.settings.views, MODEL_VIEWS, front=scene.overlay.front)
    except AssetError:  # nothing to draw: the numbers alone still say what is wrong
        return ()
    return tuple(LabelledImage(label=name, png=png_bytes(views[name])) for name in MODEL_VIEWS)
