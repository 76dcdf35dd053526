"""A request to a model and what came back: small, picklable records, since the asker may sit in another process."""

from schemas.base import Frozen
from schemas.call import ModelCall


class LabelledImage(Frozen):
    """A PNG that the model may look at, with the label that the prompt calls it by."""

    label: str
    png: bytes


class ModelRequest(Frozen):
    """One question: ``system`` says how to answer, ``text`` holds structured information and the user's
    guidance as data."""

    purpose: str
    system: str
    text: str
    images: tuple[LabelledImage, ...] = ()


class ModelAnswer(Frozen):
    """The answer's text, or None with ``error`` saying why there is none; ``calls`` holds one row per attempt."""

    content: str | None
    calls: tuple[ModelCall, ...]
    error: str | None = None
