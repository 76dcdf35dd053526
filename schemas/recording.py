"""A folder of recorded answers: where each answer came from, as its ``recording.json`` says."""

from datetime import datetime

from pydantic import Field

from schemas.base import Frozen, NonNegative


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
