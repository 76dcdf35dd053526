"""A doubtful answer is asked about once more, with what it comes to; where doubt remains, several answers are taken."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from asset2sim.guidance.parts import parts_of
from asset2sim.guidance.placing import useful_travel
from asset2sim.models.answers import median_answer, parse_overlay
from asset2sim.models.ask_overlay import Synthesized, marked_invalid
from asset2sim.models.object_facts import rounded_object_info
from asset2sim.models.prompts import with_consequences
from asset2sim.render import png_bytes, render_views
from asset2sim.validation.doubts import SCALE, AnswerOutcome, ObjectQuestion, consequences, position_sigma, scale_sigma
from asset2sim.validation.sanity import corrected_proposal
from schemas.errors import AssetError, InvalidAnswerError
from schemas.finding import Finding
from schemas.model_names import is_local
from schemas.overlay import Overlay
from schemas.request import LabelledImage, ModelAnswer, ModelAsk, ModelCall, ModelRequest
from schemas.vocabulary import Correction, Severity, Stage

PICTURE = "perspective"
"""The view of a result that a model is shown."""


@dataclass
class AnswerLog:
    """The calls and findings so far."""

    calls: list[ModelCall] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def note(self, severity: Severity, code: str, message: str) -> None:
        """Add a finding."""
        self.findings.append(Finding(stage=Stage.SYNTHESIZE, severity=severity, code=code, message=message))


def reconsidered(request: ModelRequest, first: Synthesized, question: ObjectQuestion, ask: ModelAsk) -> Synthesized:
    """The answer that is taken in the end, with all calls and findings; ``first`` is the answer to ``request``.

    Where that comes to something doubtful, the model is asked once more, and its second answer is taken, whatever it
    says; without one the first stands, with a finding. Where a stated σ or the difference of both is above the σ that
    settings allow, up to ``samples`` answers to the last question are asked for, and their median is taken.
    """
    answer, log = first[0], AnswerLog(list(first[1]), list(first[2]))
    answer = _in_our_units(answer, question, log)
    answers = [answer]
    found = consequences(question, answer) if question.settings.asks_again else AnswerOutcome(())
    if found.doubts:
        told = tuple(doubt.consequence for doubt in found.doubts)
        shown = answer.model_dump(mode="json", exclude_defaults=True)
        again = with_consequences(request, shown, told, answer_pictures(question, found))
        second, why = _next_answer(again, question, ask, log)
        if second is None:
            log.note(
                Severity.WARNING, "second_answer_missing", f"the first answer stands ({why}), though {'; '.join(told)}"
            )
        else:
            changed = "; ".join(differences(answer, second)) or "nothing: the model stands by its answer"
            log.note(Severity.INFO, "asked_again", f"asked again, since {'; '.join(told)}. Changed: {changed}")
            request, answers = again, [answer, second]
    taken = answers[-1]
    if question.settings.doubt.samples > 1 and is_unsure(question, answers):
        taken = _median(request, taken, question, ask, log)
    return taken, tuple(log.calls), tuple(log.findings)


def is_unsure(question: ObjectQuestion, answers: Sequence[Overlay]) -> bool:
    """Whether the last answer's σ of the scale or an asked position is above the one that settings take for granted, or
    two answers differ by more than it."""
    settings, last = question.settings.doubt, answers[-1]
    if last.uncertainty.get(SCALE, 0.0) > settings.scale_sigma:
        return True
    info = rounded_object_info(question.extraction.features)
    parts = parts_of(info, question.guidance.category)
    travels = {
        part.joint.name: useful_travel(part) for part in parts if part.joint.name in last.initial_joint_positions
    }
    if any(last.uncertainty.get(name, 0.0) > settings.position_sigma * travel for name, travel in travels.items()):
        return True
    if len(answers) < 2:
        return False
    before = answers[0].initial_joint_positions
    return abs(math.log(last.scale) - math.log(answers[0].scale)) > scale_sigma(last, settings) or any(
        name not in before
        or abs(last.initial_joint_positions[name] - before[name]) > position_sigma(last, name, travel, settings)
        for name, travel in travels.items()
    )


def differences(before: Overlay, after: Overlay) -> list[str]:
    """Differences of another answer in scale, positions and holding, in words."""
    found = []
    if not math.isclose(before.scale, after.scale, rel_tol=1e-3):
        found.append(f"scale {before.scale:.4g} → {after.scale:.4g}")
    old, new = before.initial_joint_positions, after.initial_joint_positions
    for name in dict.fromkeys((*old, *new)):
        if name not in old or name not in new or not math.isclose(old[name], new[name], rel_tol=1e-3, abs_tol=1e-4):
            found.append(f"{name} {_position(old.get(name))} → {_position(new.get(name))}")
    held = {joint.name: joint.holds for joint in before.joints}
    found += [
        f"{joint.name} {'holds' if joint.holds else 'no longer holds'}"
        for joint in after.joints
        if bool(joint.holds) != bool(held.get(joint.name))
    ]
    return found


def answer_pictures(question: ObjectQuestion, found: AnswerOutcome) -> tuple[LabelledImage, ...]:
    """Pictures of the object as an answer has it, where it starts and where gravity leaves it; none for a model of
    tables or files."""
    if is_local(question.settings.model.model) or not found.starts:
        return ()
    poses = {"the result of your answer, as it starts": found.starts}
    if found.ends:
        poses["the result of your answer, where gravity leaves it"] = {**found.starts, **found.ends}
    try:
        views = {
            label: render_views(
                question.extraction.urdf, pose, question.settings.views, front=question.extraction.features.front
            )
            for label, pose in poses.items()
        }
    except AssetError:  # nothing to draw: the words alone still say it
        return ()
    return tuple(LabelledImage(label=label, png=png_bytes(view[PICTURE])) for label, view in views.items())


def _median(request: ModelRequest, taken: Overlay, question: ObjectQuestion, ask: ModelAsk, log: AnswerLog) -> Overlay:
    """The median of the answer that was taken and of the others to the same question."""
    answers, wanted = [taken], question.settings.doubt.samples
    for sample in range(1, wanted):
        answer, why = _next_answer(request.model_copy(update={"sample": sample}), question, ask, log)
        if answer is None:
            log.note(Severity.WARNING, "samples_missing", f"answer {sample + 1} of {wanted} is left out: {why}")
            if not log.calls or log.calls[-1].outcome != "invalid_answer":
                break  # a budget, a provider or a recording that has no more
        else:
            answers.append(answer)
    middle = median_answer(answers)
    scales = ", ".join(f"{answer.scale:.4g}" for answer in answers)
    message = f"the median of {len(answers)} answers is taken, since the model is unsure: scale {middle.scale:.4g} of"
    log.note(Severity.INFO, "samples_taken", f"{message} {scales}")
    return middle


def _next_answer(
    request: ModelRequest, question: ObjectQuestion, ask: ModelAsk, log: AnswerLog
) -> tuple[Overlay | None, str]:
    """A further answer in our units, or None and why there is none; its calls are added."""
    answer: ModelAnswer = ask(request)
    if answer.content is None:
        log.calls.extend(answer.calls)
        return None, answer.error or "the model failed"
    try:
        found = parse_overlay(answer.content, question.extraction.features)
    except InvalidAnswerError as error:
        log.calls.extend(marked_invalid(answer.calls))
        return None, f"it does not fit: {error}"
    log.calls.extend(answer.calls)
    return _in_our_units(found, question, log), ""


def _in_our_units(answer: Overlay, question: ObjectQuestion, log: AnswerLog) -> Overlay:
    """The answer with its units corrected, where settings let them be."""
    if question.settings.correction is Correction.OFF:
        return answer
    physics = question.settings.physics
    answer, found = corrected_proposal(
        question.extraction, answer, question.guidance, physics, Correction.UNITS, semantics=False
    )
    log.findings.extend(found)
    return answer


def _position(at: float | None) -> str:
    return "–" if at is None else f"{at:.4g}"
