"""The models of this process by name: the offline one, whose answer to a prompt is from the prompt's text alone, which
is what any model gets, and those that extensions add.

So it reads the user's sentence itself, once an answer, with the tables and rules of ``asset2sim.guidance``: its reading
is a model's, and the record that our rules were given is not known to it.
"""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

from asset2sim.guidance import tables
from asset2sim.guidance.edges import fitted_kind
from asset2sim.guidance.object_info import ObjectInfo, read_prompt
from asset2sim.guidance.parts import parts_of
from asset2sim.guidance.placing import asked_positions
from asset2sim.guidance.read import read_guidance
from asset2sim.guidance.sizing import propose_scale
from asset2sim.guidance.supports import STANDS_CONFIDENCE, usual_support
from asset2sim.models.gateway.chat_messages import message_text
from asset2sim.models.prior.joint_proposals import propose_joints
from asset2sim.models.prior.link_proposals import propose_links
from asset2sim.models.prior.refinement import read_refinement, refinement_step
from schemas.declared import TOOLS
from schemas.errors import ModelError, UnknownChoiceError, UsageError
from schemas.extensions import local_models, missing, object_at, offline_answers
from schemas.model_names import HOUSEHOLD
from schemas.overlay import Overlay
from schemas.support import Mount, SupportKind, SupportProposal


def answer(text: str) -> str:
    """The JSON answer to a prompt: an ``Overlay``, or for purpose "refinement" the keys state_ok, approved and deltas.

    For the purposes of an extension's methods it is what that makes of the overlay (``offline_answers``). Works from
    ``text`` alone, and the same text always gives the same answer. A text without the two blocks is answered as an
    object of which nothing is known.
    """
    information, words = read_prompt(text)
    purpose = information.get("purpose")
    if purpose == "refinement":
        return json.dumps(refinement_step(*read_refinement(information)), sort_keys=True)
    info = ObjectInfo.from_json(information)
    overlay: Overlay = prior_overlay(info, words)
    if further := offline_answers().get(str(purpose)):
        overlay = object_at(further)(info, overlay)
    return overlay.model_dump_json(exclude_none=True)


_PLACED = {"stands": (SupportKind.FREESTANDING, None), "hangs": (SupportKind.FIXED, Mount.WALL)}
"""Placing in the table of proportions → kind of support and mount of an object whose edges are of that kind."""

_SAME_SIZE = 1.6
"""Factor by which an object may be larger or smaller than the kind of its edges to be placed as that is: a cupboard of
1.9 m that is shaped as a mirror cabinet stands."""


def prior_overlay(info: ObjectInfo, words: str) -> Overlay:
    """An overlay for any object and any user's words, from the tables; deterministic."""
    guidance = read_guidance(words, info)
    size, parts = tables.sizes()[guidance.category], parts_of(info, guidance.category)
    support = guidance.support or usual_support(info, guidance.called, guidance.category)
    shape = fitted_kind(info, size.category, guidance.size.kinds)
    scale = propose_scale(info, size, guidance.size, support)
    like = shape is not None and abs(math.log(scale.value / shape.scale)) < math.log(_SAME_SIZE)
    if guidance.support is None and shape is not None and like and shape.placed in _PLACED:
        kind, mount = _PLACED[shape.placed]
        said = f"its edges are those of a {shape.kind}, which {shape.placed}"
        support = SupportProposal(kind=kind, mount=mount, confidence=STANDS_CONFIDENCE, reason=said)
    positions = asked_positions(parts, guidance, scale.value)
    links, mass_notes, change = propose_links(info, parts, guidance, scale.value, scale.final_m)
    joints, feel_notes = propose_joints(parts, guidance, positions)
    category_note = f"category {'unknown' if size.category == '*' else size.category}: {guidance.category_from}"
    state_notes = (wish.describe() for wish in guidance.states)
    return Overlay(
        scale=scale.value,
        contact_material=size.contact,
        support=support,
        links=links,
        joints=joints,
        initial_joint_positions=positions,
        mass_change=change,
        uncertainty={"scale": scale.sigma} if scale.sigma else {},
        asked=(*(("scale",) if scale.asked else ()), *positions),
        notes=(category_note, scale.note, *state_notes, *mass_notes, *feel_notes),
    )


Answers = Callable[[str, str, int], str]
"""Question with an object's facts, all that was said, number of the sample → the answer's text."""


def answers_of(model: str) -> Answers:
    """The answers of the model of that name. Raises UsageError for a name that no model of this process has."""
    found = local_models()
    if model == HOUSEHOLD:
        return lambda text, conversation, sample: answer(text)
    kind = found.get(model.partition("@")[0])
    if kind is not None:
        answers: Answers = object_at(kind.answers)(model)
        return answers
    needed = missing(model)
    choices = HOUSEHOLD, *(own.form for own in found.values())
    raise UsageError(needed) if needed else UnknownChoiceError("model", model, choices)


CHARACTERS_PER_TOKEN = 4
"""Characters per token of what these models read and say, which no tokenizer cuts: English has 4."""


class PriorError(ModelError):
    """A model of this process failed; asking again cannot help, because it depends on the question alone."""

    status_code = 400


def completion(model: str, messages: Sequence[Mapping[str, Any]], with_tools: bool, sample: int) -> SimpleNamespace:
    """One response, with its tokens. A request with tools is answered by the extension that has a method which asks so,
    any other by ``prior.answer`` from the last user message that describes an object. It depends only on the messages,
    whether there are tools, and the number of the sample. Raises ``PriorError``, whatever went wrong."""
    try:
        content, calls = next_answer(model, messages, with_tools, sample)
    except Exception as error:
        raise PriorError(f"{type(error).__name__}: {error}") from error
    asked = sum(count_tokens(text_and_calls(message)) for message in messages)
    said = count_tokens((content or "") + "".join(call["function"]["arguments"] for call in calls))
    tool_calls = [SimpleNamespace(id=call["id"], function=SimpleNamespace(**call["function"])) for call in calls]
    message = SimpleNamespace(content=content, tool_calls=tool_calls)
    choice = SimpleNamespace(message=message, finish_reason="tool_calls" if calls else "stop")
    return SimpleNamespace(choices=[choice], usage=SimpleNamespace(prompt_tokens=asked, completion_tokens=said))


def next_answer(
    model: str, messages: Sequence[Mapping[str, Any]], with_tools: bool, sample: int
) -> tuple[str | None, list[dict[str, Any]]]:
    """Text and tool calls (in OpenAI's format) of the next message from a model of this process."""
    answers = answers_of(model)
    conversation = "\n".join(text_and_calls(message) for message in messages if message.get("role") != "system")

    def proposal(text: str) -> str:
        return answers(text, conversation, sample)

    turns = offline_answers().get(TOOLS) if with_tools else None
    if turns is None:
        return proposal(user_text(messages)), []
    said: tuple[str | None, list[dict[str, Any]]] = object_at(turns)(messages, proposal)
    return said


def user_text(messages: Iterable[Mapping[str, Any]]) -> str:
    """The text of the last user message with an object's facts, else of the last; empty where there is none."""
    texts = [message_text(message) for message in messages if message.get("role") == "user"]
    stating = [text for text in texts if "<structured_information>" in text]
    return (stating or texts or [""])[-1]


def text_and_calls(message: Mapping[str, Any]) -> str:
    """A message's text, with its tool calls as JSON below."""
    calls = [
        {key: (call.get("function") or {}).get(key) for key in ("name", "arguments")}
        for call in message.get("tool_calls") or ()
    ]
    return message_text(message) + (f"\n{json.dumps(calls)}" if calls else "")


def count_tokens(text: str) -> int:
    """Tokens of a text, estimated from its length."""
    return -(-len(text) // CHARACTERS_PER_TOKEN)
