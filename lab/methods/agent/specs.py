"""The agent's tools: the arguments of each, stated once as a record, from which follow its JSON Schema and what it
refuses; and the bounds of a conversation."""

from typing import Any, Literal

from pydantic import Field

from asset2sim.models.answers import trimmed
from schemas.base import Finite, Frozen, Inertia6, NonNegative, Positive, Vector3
from schemas.request import Tool

View = Literal["front", "back", "left", "right", "perspective"]


class LinkTerms(Frozen):
    """Terms of a link that ``set_parameters`` takes; a null removes what was set."""

    name: str
    material: str | None = None
    mass_kg: Positive | None = Field(None, description="kg")
    com: Vector3 | None = Field(None, description="centre of mass in the link's own frame at the final scale, m")
    inertia: Inertia6 | None = Field(None, description="ixx, ixy, ixz, iyy, iyz, izz about the centre of mass, kg·m²")


class JointTerms(Frozen):
    """Terms of a joint that ``set_parameters`` takes: those of a URDF, not the ones from which our rules derive them,
    and whether the hold check applies."""

    name: str
    damping: NonNegative | None = Field(None, description="N·m·s/rad, or N·s/m for a prismatic joint")
    friction: NonNegative | None = Field(None, description="N·m, or N for a prismatic joint")
    stiffness: NonNegative | None = Field(None, description="N·m/rad, or N/m for a prismatic joint")
    spring_rest: Finite | None = Field(None, description="position to which a spring returns, rad, or m at scale 1")
    holds: bool | None = Field(None, description="whether the part must stay wherever it is put")


class JointStart(Frozen):
    """Where a joint starts."""

    joint: str
    position: Finite | None = Field(description="rad, or m at scale 1 for a prismatic joint")


class ReadAsset(Frozen):
    """Read the asset as records in JSON: a summary, its links (boxes, volumes), its joints (limits), or its files.
    Lengths are metres at scale 1."""

    part: Literal["summary", "links", "joints", "files"] = "summary"
    start: int = Field(0, ge=0, description="first row, where a reading is long")


class Render(Frozen):
    """Look at the object with the present parameters, in its initial state: pictures of these views, and every link's
    box in the world. Without views: all of them."""

    views: tuple[View, ...] = Field((), description="which views")


class SetParameters(Frozen):
    """Set parameters. What is named replaces what was set before, field by field; all else stays. Positions are where
    joints start."""

    scale: Positive | None = Field(None, description="real size over authored size, for the whole object")
    contact_material: str | None = None
    links: tuple[LinkTerms, ...] = ()
    joints: tuple[JointTerms, ...] = ()
    initial_joint_positions: tuple[JointStart, ...] = ()


class Simulate(Frozen):
    """Put the object on a plane in PyBullet with the present parameters, let it settle, and watch it untouched: overlap
    in the initial state, drift of the root, oscillation of joints."""


class ReadContacts(Frozen):
    """List the pairs of links that overlap in the initial state, deepest first."""


class Finish(Frozen):
    """End: the present parameters are what you propose."""

    notes: str = ""


ARGUMENTS: dict[str, type[Frozen]] = {
    "read_asset": ReadAsset, "render": Render, "set_parameters": SetParameters, "simulate": Simulate,
    "read_contacts": ReadContacts, "finish": Finish,
}  # fmt: skip
"""Name of each tool → its arguments, in the order sent to the model."""
TOOL_NAMES = tuple(ARGUMENTS)


def tool_of(name: str, arguments: type[Frozen]) -> Tool:
    """A tool as the model is told of it: what it does is the first thing said of its arguments."""
    schema: dict[str, Any] = trimmed(arguments.model_json_schema(), frozenset(), words=("title", "default"))
    return Tool(name=name, description=" ".join(schema.pop("description").split()), parameters=schema)


TOOLS = tuple(tool_of(name, arguments) for name, arguments in ARGUMENTS.items())
"""All tools, in the order sent to the model."""

MAX_ANSWER_CALLS = 8
"""Most tool calls of one answer that are run; others are dropped, and the model is told so."""
MAX_CALLS = 60
"""Most tool calls for one asset: five for each of the twelve answers of the default budget."""
MAX_SAME = 3
"""Identical answers in a row that end the conversation: the tools would return the same results."""
MAX_ARGUMENT_CHARS = 100_000
"""Longest arguments of one call that are parsed: an object with a thousand joints needs less."""
MAX_RESULT_CHARS = 16_000
"""Longest result of one tool, about 4000 tokens."""
MAX_SAID_CHARS = 4_000
"""Longest text of one model answer that is sent back with the conversation."""
MAX_TALK_CHARS = 160_000
"""Longest conversation, about 40,000 tokens; beyond it the oldest results and arguments are left out."""
MAX_ROOMLESS_CHARS = 200
"""Arguments up to this length are kept even in a conversation that is too long."""
MAX_ID_CHARS = 20_000
"""Longest call identifier that is kept: some providers put the model's signed reasoning into it."""
MAX_QUOTED_CHARS = 200
"""Longest quotation of a wrong value in an error."""
MAX_ROWS = 40
"""Most joints, links or pairs that one result lists."""
MAX_NOTES = 10
"""Most notes kept from ``finish``."""
MAX_NOTE_CHARS = 500
"""Longest note kept."""
TOOL_LIMIT_S = 60.0
"""Wall-time limit of one simulation, rendering or contact query, s; then its process is killed."""
TOOL_SHARE = 0.5
"""Share of the asset's time limit for all tools together: the rest is for verification."""
MIN_TOOL_S = 1.0
"""With less time left than this, s, no tool is started."""
