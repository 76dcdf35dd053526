"""Agent loop: ask, run the tools that the answer calls, repeat until the agent finishes or a limit is reached."""

import hashlib
import tempfile
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import ProposalJob
from asset2sim.baselines.ours import first_question
from asset2sim.models.answers import parse_overlay
from asset2sim.models.ask_overlay import SynthesisError, Synthesized, images_not_sent, marked_invalid, no_answer_error
from lab.methods.agent.conversation import bounded, model_turn
from lab.methods.agent.results import cut, short
from lab.methods.agent.scratch_folder import ScratchFolder, ToolError
from lab.methods.agent.specs import MAX_ANSWER_CALLS, MAX_CALLS, MAX_SAID_CHARS, MAX_SAME, TOOL_NAMES, TOOL_SHARE, TOOLS
from lab.methods.agent.tools import AgentSession, run_tool
from schemas.errors import InvalidAnswerError
from schemas.finding import Finding
from schemas.request import ModelAnswer, ModelCall, ModelRequest, Turn
from schemas.vocabulary import FailureMode, Severity, Source, Stage

AGENT = "agent"
USE_TOOLS = (
    "That is neither a tool call nor an overlay in JSON. Go on by calling one of the tools: "
    f"{', '.join(TOOL_NAMES)}. Call finish when you are done."
)
"""Sent once to a model that answers with text instead of a tool call."""
FINISHED, IN_TEXT, SPENT = "it finished", "it answered with an overlay in text", "its steps are spent"
TALKED, LOOPED = "it went on talking without calling a tool", f"it made the same calls {MAX_SAME} times in a row"
OVERUSED = f"it made {MAX_CALLS} tool calls"
"""Reasons why a conversation ends."""


@dataclass
class Conversation:
    """State of a conversation: its turns, calls, findings, and the reason why it ended."""

    turns: list[Turn] = field(default_factory=list)
    calls: list[ModelCall] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    steps: int = 0
    ended: str | None = None
    silent: ModelAnswer | None = None
    told: bool = False
    recent: list[str] = field(default_factory=list)


def run_agent(job: ProposalJob, extraction: Extraction) -> Synthesized:
    """A model with tools finds parameters, in at most ``methods.agent_steps`` answers; its calls; findings.

    None of our rules or searches change them; they are validated only as far as writing a file needs. However the
    conversation ends, the last parameters count. Raises ``SynthesisError`` where no scale was set: ``model_error`` or
    ``budget`` where the provider fails, else ``no_valid_estimate``.
    """
    talk, steps = Conversation(), job.settings.methods.agent_steps
    with tempfile.TemporaryDirectory(prefix="asset2sim-agent-") as name:
        seconds = TOOL_SHARE * job.settings.run.asset_time_limit_s
        scratch = ScratchFolder(extraction, job.settings, job.source, Path(name), seconds, job.guidance)
        session = AgentSession(scratch, blind="the prior looks at no pictures" if job.source is Source.PRIOR else None)
        first = opening(job, extraction)
        while talk.ended is None:
            answer = job.ask(first.model_copy(update={"turns": bounded(talk.turns)}))
            take(answer, talk, session, steps)
    overlay = session.overlay
    if overlay is None:
        if talk.silent is not None:
            raise no_answer_error(talk.silent, talk.calls)
        message = f"the agent set no scale in {talk.steps} answers: {talk.ended}"
        if session.refusals:
            message = f"{message}; the last refusal was {cut(session.refusals[-1], MAX_SAID_CHARS)}"
        raise SynthesisError(FailureMode.NO_VALID_ESTIMATE, "no_scale", message, talk.calls)
    overlay = overlay.model_copy(update={"notes": (*overlay.notes, *session.notes)})
    return overlay, tuple(talk.calls), (*talk.findings, *told(talk, session))


def opening(job: ProposalJob, extraction: Extraction) -> ModelRequest:
    """First request: the same facts and pictures as for every method, and the tools."""
    request = first_question(AGENT, job, extraction)
    return request.model_copy(update={"tools": TOOLS, "answer_schema": None})


def take(answer: ModelAnswer, talk: Conversation, session: AgentSession, most_steps: int) -> None:
    """Process one answer: run its tool calls or parse it as an overlay, and set ``talk.ended`` where it is the last."""
    if answer.without_images is not None and session.blind is None:
        session.blind = answer.without_images
        talk.findings.extend(images_not_sent(answer))
    if not answer.tool_calls and answer.content is None:
        talk.calls.extend(answer.calls)
        talk.silent, talk.ended = answer, f"the model gave no answer: {answer.error or 'no reason is known'}"
        return
    talk.steps += 1
    useful = take_calls(answer, talk, session) if answer.tool_calls else take_text(answer, talk, session)
    talk.calls.extend(answer.calls if useful else marked_invalid(answer.calls))
    if talk.ended is None and talk.steps >= most_steps:
        talk.ended = SPENT


def take_calls(answer: ModelAnswer, talk: Conversation, session: AgentSession) -> bool:
    """Run an answer's calls in order; True if any of them succeeded."""
    room = min(MAX_ANSWER_CALLS, MAX_CALLS - session.n_calls)
    known = {call.call_id for turn in talk.turns for call in turn.tool_calls}
    turn = model_turn(answer, room, known, talk.steps)
    talk.turns.append(turn)
    refusals, ran = len(session.refusals), 0
    for sent, call in zip(turn.tool_calls, answer.tool_calls, strict=False):
        talk.turns.append(Turn(role="tool", content=run_tool(session, call), call_id=sent.call_id))
        ran += 1
        if session.finished:
            break
    dropped = len(answer.tool_calls) - len(turn.tool_calls)
    remarks = []
    if dropped:
        asked = len(answer.tool_calls)
        remarks.append(f"{dropped} of {asked} calls were not run; an answer may make {MAX_ANSWER_CALLS}.")
    if session.images:
        remarks.append("Pictures of the initial state follow.")
    if remarks:
        talk.turns.append(Turn(role="user", content=" ".join(remarks), images=session.images))
        session.images = ()
    wishes = repr([(call.name, call.arguments) for call in answer.tool_calls])
    talk.recent.append(hashlib.sha256(wishes.encode("utf-8", "replace")).hexdigest())
    del talk.recent[:-MAX_SAME]
    if session.finished:
        talk.ended = FINISHED
    elif session.n_calls >= MAX_CALLS:
        talk.ended = OVERUSED
    elif len(talk.recent) == MAX_SAME and len(set(talk.recent)) == 1:
        talk.ended = LOOPED
    return len(session.refusals) - refusals < ran


def take_text(answer: ModelAnswer, talk: Conversation, session: AgentSession) -> bool:
    """Process an answer without a tool call: an overlay ends the conversation, other text is refused once."""
    content = answer.content or ""
    try:
        overlay = parse_overlay(content, session.scratch.extraction.features)
        session.scratch.completed(overlay)
    except (InvalidAnswerError, ToolError) as error:
        session.refusals.append(f"text: {error}")
        talk.turns.append(Turn(role="assistant", content=cut(content, MAX_SAID_CHARS)))
        talk.turns.append(Turn(role="user", content=f"{USE_TOOLS} (As an overlay: {short(str(error))})"))
        talk.recent.clear()
        if talk.told:
            talk.ended = TALKED
        talk.told = True
        return False
    session.overlay, talk.ended = overlay, IN_TEXT
    return True


def told(talk: Conversation, session: AgentSession) -> tuple[Finding, ...]:
    """Findings: number of answers and calls, why the conversation ended, and refused calls."""
    finding = partial(Finding, stage=Stage.SYNTHESIZE)
    severity = Severity.INFO if talk.ended in (FINISHED, IN_TEXT) else Severity.WARNING
    text = f"the agent ended after {talk.steps} answers and {session.n_calls} tool calls: {talk.ended}"
    ended = finding(severity=severity, code="agent_ended", message=text, value=float(talk.steps))
    if not session.refusals:
        return (ended,)
    count, first = len(session.refusals), cut(session.refusals[0], MAX_SAID_CHARS)
    text = f"{count} of the agent's wishes were refused; the first: {first}"
    return ended, finding(severity=Severity.WARNING, code="agent_refused", message=text, value=float(count))
