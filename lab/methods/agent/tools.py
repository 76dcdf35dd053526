"""Run the agent's tools: every call returns a text for the model, even for a failed call."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from asset2sim.models.answers import strict_fit
from asset2sim.render import VIEW_NAMES
from lab.methods.agent.conversation import arguments_of
from lab.methods.agent.draft import Draft, checked, merged
from lab.methods.agent.results import boxes_text, cut, read_part, refused, short, simulated, text_of, touching
from lab.methods.agent.scratch_folder import ScratchFolder, ToolError
from lab.methods.agent.specs import (
    ARGUMENTS,
    MAX_NOTE_CHARS,
    MAX_NOTES,
    TOOL_NAMES,
    Finish,
    ReadAsset,
    ReadContacts,
    Render,
    SetParameters,
    Simulate,
)
from schemas.base import Frozen
from schemas.errors import InvalidAnswerError, UnknownChoiceError
from schemas.overlay import Overlay
from schemas.request import LabelledImage, ToolCall


@dataclass
class AgentSession:
    """Parameters that the agent has set so far, and the state of its tools: ``images`` are rendered but not yet sent,
    ``blind`` is the reason why no pictures are sent (None: they are), ``refusals`` the text of every refusal."""

    scratch: ScratchFolder
    blind: str | None = None
    draft: Draft = field(default_factory=dict)
    overlay: Overlay | None = None
    images: tuple[LabelledImage, ...] = ()
    notes: tuple[str, ...] = ()
    finished: bool = False
    n_calls: int = 0
    refusals: list[str] = field(default_factory=list)

    @property
    def present(self) -> Overlay:
        """Parameters to try: those set so far, at the authored scale while none is set."""
        if self.overlay is not None:
            return self.overlay
        return checked({**self.draft, "scale": 1.0}, self.scratch.extraction.features) or Overlay(scale=1.0)


def run_tool(session: AgentSession, call: ToolCall) -> str:
    """Result of one call as text for the model; an error names the valid choices."""
    session.n_calls += 1
    try:
        if call.name not in ARGUMENTS:
            raise UnknownChoiceError("tool", short(call.name), TOOL_NAMES)
        stated = {key: value for key, value in arguments_of(call.arguments).items() if value is not None}
        arguments = strict_fit(ARGUMENTS[call.name], stated)
        return cut(without_paths(session.scratch, RUNNERS[type(arguments)](session, arguments)))
    except (ToolError, InvalidAnswerError, UnknownChoiceError) as error:
        message = without_paths(session.scratch, str(error))
        session.refusals.append(f"{short(call.name)}: {message}")
        return cut(refused(message))


def without_paths(scratch: ScratchFolder, text: str) -> str:
    """The text without this machine's folder names: they differ in every run, so that the same conversation would miss
    the answer cache, and a model must not see them."""
    for folder in (scratch.path, scratch.extraction.folder):
        text = text.replace(str(folder), "asset")
    return text


def _read_asset(session: AgentSession, arguments: ReadAsset) -> str:
    return read_part(session.scratch.extraction, arguments.part, arguments.start)


def _set_parameters(session: AgentSession, arguments: SetParameters) -> str:
    draft = merged(session.draft, arguments)
    overlay = checked(draft, session.scratch.extraction.features)
    if overlay is not None:
        session.scratch.completed(overlay)
    session.draft, session.overlay = draft, overlay
    return text_of({
        "scale": draft.get("scale", "not set yet; 1 is tried, and you cannot finish without it"),
        "n_links_set": len(draft["links"]),
        "n_joints_set": len(draft["joints"]),
        "n_positions_set": len(draft["initial_joint_positions"]),
    })  # fmt: skip


def _simulate(session: AgentSession, arguments: Simulate) -> str:
    physics, measurement = session.scratch.simulate(session.present)
    return simulated(measurement, physics, session.scratch.settings.thresholds)


def _read_contacts(session: AgentSession, arguments: ReadContacts) -> str:
    return touching(session.scratch.contacts(session.present))


def _render(session: AgentSession, arguments: Render) -> str:
    boxes = session.scratch.boxes(session.present)
    if session.blind is not None:
        return boxes_text(boxes, f"not sent: {session.blind}")
    session.images = session.scratch.pictures(session.present, tuple(dict.fromkeys(arguments.views)) or VIEW_NAMES)
    return boxes_text(boxes, "they follow, each after its label")


def _finish(session: AgentSession, arguments: Finish) -> str:
    if session.overlay is None:
        raise ToolError("no scale is set: call set_parameters with a scale first")
    if arguments.notes.strip() and len(session.notes) < MAX_NOTES:
        session.notes = (*session.notes, cut(arguments.notes.strip(), MAX_NOTE_CHARS))
    session.finished = True
    return text_of({"finished": True})


RUNNERS: dict[type[Frozen], Callable[[AgentSession, Any], str]] = {
    ReadAsset: _read_asset, Render: _render, SetParameters: _set_parameters, Simulate: _simulate,
    ReadContacts: _read_contacts, Finish: _finish,
}  # fmt: skip
"""Arguments of a tool → function that runs it."""
