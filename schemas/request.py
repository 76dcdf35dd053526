"""Model requests and answers: small, picklable records, since the caller may run in another process."""

from collections.abc import Callable
from datetime import datetime
from typing import Any, Literal

from pydantic import Field

from schemas.base import Frozen, NonNegative


class ModelCall(Frozen):
    """Purpose, tokens, cost, latency and outcome (``ok``, ``invalid_answer``, ``provider_error``, ``cached``)."""

    purpose: str
    model: str
    attempt: int
    prompt_tokens: int
    completion_tokens: int
    cost_usd: float
    latency_s: float
    cached: bool
    outcome: str
    prompt_hash: str
    answer_file: str | None = None
    """File that holds the answer: below OUT's folder of answers, or in that of a recorded model; None: not kept."""
    answered_by: str | None = None
    """Model that once gave a recorded answer; None for every other, and where the recording does not say."""


class LabelledImage(Frozen):
    """A PNG that the model may look at, with the label that the prompt calls it by."""

    label: str
    png: bytes


class Tool(Frozen):
    """A function that the model may ask for; ``parameters`` is the JSON Schema of its arguments."""

    name: str
    description: str
    parameters: dict[str, Any]


class ToolCall(Frozen):
    """A model's request to run a tool; ``arguments`` is its JSON text, not validated."""

    call_id: str
    name: str
    arguments: str


class Turn(Frozen):
    """One earlier message of a conversation: the model's own, what a tool returned, or what the user added."""

    role: Literal["assistant", "tool", "user"]
    content: str = ""
    tool_calls: tuple[ToolCall, ...] = ()
    call_id: str | None = None
    images: tuple[LabelledImage, ...] = ()


class ModelRequest(Frozen):
    """One question: ``system`` says how to answer, ``text`` holds structured information and the user's guidance as
    data. ``answer_schema`` is the JSON Schema of the answer, for models that can be held to one. ``turns`` come after
    ``text``, oldest first. ``sample`` numbers repeats of the same question, each answered separately."""

    purpose: str
    system: str
    text: str
    images: tuple[LabelledImage, ...] = ()
    answer_schema: dict[str, Any] | None = None
    turns: tuple[Turn, ...] = ()
    tools: tuple[Tool, ...] = ()
    sample: int = 0


class ModelAnswer(Frozen):
    """The answer's text, or None with ``error`` saying why there is none; ``calls`` holds one row per attempt.
    ``tool_calls`` are the tools to run before the model continues. ``budget_spent`` says that a budget, not the model,
    is why nothing was asked, ``unrecorded`` that a recorded model has no answer to this question. ``without_images``
    says why images that the request had were not sent, ``other_question`` that a recorded answer is to another one."""

    content: str | None
    calls: tuple[ModelCall, ...]
    error: str | None = None
    tool_calls: tuple[ToolCall, ...] = ()
    budget_spent: bool = False
    without_images: str | None = None
    unrecorded: bool = False
    other_question: str | None = None


ModelAsk = Callable[[ModelRequest], ModelAnswer]
"""Function that asks a model one question; budgets, caches and processes are behind it."""


class AnswerOrigin(Frozen):
    """Who answered, when, to which prompt (its title and version) and question, and what it took; None where not known.
    ``without_images`` says why pictures were not sent."""

    model: str | None = None
    answered_at: datetime | None = None
    prompt: str | None = None
    prompt_hash: str | None = None
    prompt_tokens: int | None = Field(None, ge=0)
    completion_tokens: int | None = Field(None, ge=0)
    cost_usd: NonNegative | None = None
    without_images: str | None = None


class Recording(Frozen):
    """Content of ``recording.json``: ``model`` and ``prompt`` of the answers that do not say it themselves, the methods
    that asked, when the folder was made and by which version, and file name → origin. Every field may be left out."""

    model: str | None = None
    prompt: str | None = None
    note: str | None = None
    methods: tuple[str, ...] = ()
    recorded_at: datetime | None = None
    asset2sim: str | None = None
    answers: dict[str, AnswerOrigin] = Field(default_factory=dict)
