"""One model call, as the catalog keeps it."""

from schemas.base import Frozen


class ModelCall(Frozen):
    """What was asked for, what it cost and how it ended (``ok``, ``invalid_answer``, ``provider_error``,
    ``cached``)."""

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
