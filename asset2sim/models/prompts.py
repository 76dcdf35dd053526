"""The prompts: a versioned text as the system part, and the object's facts and the user's words as blocks of data."""

import functools
import json
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from asset2sim.models.answers import overlay_schema
from asset2sim.models.object_facts import rounded_floats, synthesis_facts
from schemas.features import Features, RestOverlap
from schemas.request import LabelledImage, ModelRequest

SHARED = "shared"
"""The file of the sections that several prompts hold: what every method is told of the object, and by which conventions
it answers."""
SYNTHESIS = "synthesis"
DIRECT = "direct"
IVW = "ivw"
AUTHORED = "authored"
"""The file of the section on numbers that a file in metres states itself, which our method asks about."""

_ESCAPES = str.maketrans({"<": "\\u003c", ">": "\\u003e", "&": "\\u0026"})


def overlay_request(
    purpose: str,
    features: Features,
    guidance: str | None,
    images: Sequence[LabelledImage] = (),
    view: str | None = None,
    overlaps: Sequence[RestOverlap] = (),
) -> ModelRequest:
    """The request for an overlay, of the same facts for every method; ``purpose`` names the prompt, which says which
    terms are wanted. ``view`` names the one view that the question is about, where it is about one."""
    facts = synthesis_facts(features, overlaps)
    information = {"purpose": purpose, **facts, **({} if view is None else {"view": view})}
    text = f"{data_block('structured_information', information)}\n\n{data_block('user_guidance', guidance or '')}"
    disputable = purpose == SYNTHESIS and bool(features.metric)
    return ModelRequest(
        purpose=purpose,
        system=f"{system_text(purpose)}\n\n{_prompt_file(AUTHORED)}" if disputable else system_text(purpose),
        text=text,
        images=tuple(images),
        answer_schema=overlay_schema(purpose, disputable=disputable),
    )


def with_validation_errors(request: ModelRequest, errors: Iterable[str]) -> ModelRequest:
    """The same request, with the last answer's violations as a further block of data."""
    return request.model_copy(update={"text": f"{request.text}\n\n{data_block('validation_errors', list(errors))}"})


def with_consequences(
    request: ModelRequest, answered: object, consequences: Sequence[str], images: Sequence[LabelledImage]
) -> ModelRequest:
    """The same request, with an answer to it and what that comes to as further blocks of data, and pictures of it."""
    blocks = (data_block("your_answer", answered), data_block("consequences", list(consequences)))
    text = "\n\n".join((request.text, *blocks))
    return request.model_copy(update={"text": text, "images": (*request.images, *images)})


def data_block(tag: str, value: object) -> str:
    """A value as compact JSON between tags, which nothing inside it can close. Angle brackets and ampersands are
    written as JSON escapes, so that the block still parses to the same value."""
    text = json.dumps(rounded_floats(value), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    # A lone surrogate, as from a badly decoded file, cannot be encoded.
    return f"<{tag}>\n{text.translate(_ESCAPES).encode('utf-8', 'replace').decode('utf-8')}\n</{tag}>"


@functools.cache
def system_text(purpose: str) -> str:
    """The system part for a purpose, from its file in ``prompt_texts``. A line ``{{Scale}}`` of it stands for that
    section of the shared file."""
    return re.sub(r"^\{\{(.+)\}\}$", lambda line: shared_sections()[line[1]], _prompt_file(purpose), flags=re.MULTILINE)


@functools.cache
def shared_sections() -> dict[str, str]:
    """Title → section, with its title, of what the prompts of all methods hold word for word."""
    found = re.findall(r"^(# ([^\n]+)\n.+?)(?=\n+# |\Z)", _prompt_file(SHARED).rstrip(), flags=re.MULTILINE | re.DOTALL)
    return {title: section for section, title in found}


def _prompt_file(name: str) -> str:
    return (Path(__file__).parent / "prompt_texts" / f"{name}.md").read_text(encoding="utf-8")
