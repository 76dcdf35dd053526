"""What one asset asks a model about its state: each question once, a refused answer once more, and then no more."""

from dataclasses import dataclass, field

from asset2sim.models.answers import InvalidFieldsError, RefinementAnswer, parse_refinement
from asset2sim.models.ask_overlay import images_not_sent, marked_invalid
from asset2sim.models.prompts import with_validation_errors
from schemas.errors import InvalidAnswerError
from schemas.finding import Finding
from schemas.request import ModelAnswer, ModelAsk, ModelCall, ModelRequest
from schemas.vocabulary import Severity, Stage


@dataclass
class Questions:
    """Who is asked, how many times more, and what came of it so far.

    It outlives every attempt at an asset: one that is made again meets the same answers, and what was asked in one
    that was dropped still counts. ``wanted`` says that there was something to ask.
    """

    ask: ModelAsk
    left: int
    calls: list[ModelCall] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    known: dict[str, RefinementAnswer | None] = field(default_factory=dict)
    wanted: bool = False

    def answer(self, request: ModelRequest, focus: tuple[str, ...]) -> RefinementAnswer | None:
        """The model's step of the focus joints, or None where it has none to give; never raises for what it says."""
        self.wanted = True
        if request.text not in self.known:
            self.known[request.text] = self._ask(request, focus)
        return self.known[request.text]

    def _ask(self, request: ModelRequest, focus: tuple[str, ...]) -> RefinementAnswer | None:
        asked, refused = request, ""
        for first in (True, False):
            if self.left <= 0:
                break
            self.left -= 1
            answer = self.ask(asked)
            if first:
                self._note_images(answer)
            if answer.content is None:
                self.calls.extend(answer.calls)
                self._give_up(answer)
                return None
            try:
                step = parse_refinement(answer.content, focus)
            except InvalidAnswerError as error:
                self.calls.extend(marked_invalid(answer.calls))
                refused = str(error)
                violations = error.violations if isinstance(error, InvalidFieldsError) else (refused,)
                asked = with_validation_errors(request, violations)
                if first and self.left > 0:
                    self._note("invalid_answer", f"the model's step was refused and it was asked again: {refused}")
                continue
            self.calls.extend(answer.calls)
            return step
        if refused:
            self._note("refinement_unanswered", f"the search goes on without a step from the model: {refused}")
        return None

    def _give_up(self, answer: ModelAnswer) -> None:
        """A budget that is spent, or a provider that has failed for all its attempts, is not tried again."""
        self.left = 0
        code = "budget_spent" if answer.budget_spent else "refinement_unanswered"
        why = answer.error or ("the budget is spent" if answer.budget_spent else "the model failed")
        self._note(code, f"the search goes on without the model: {why}")

    def _note_images(self, answer: ModelAnswer) -> None:
        if all(finding.code != "images_not_sent" for finding in self.findings):
            self.findings.extend(f.model_copy(update={"stage": Stage.REFINE}) for f in images_not_sent(answer))

    def _note(self, code: str, message: str) -> None:
        self.findings.append(Finding(stage=Stage.REFINE, severity=Severity.WARNING, code=code, message=message))
