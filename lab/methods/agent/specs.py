"""Tool specifications for the agent: names, descriptions, and the JSON Schema of the arguments."""

from typing import Any

from asset2sim.render import VIEW_NAMES
from schemas.request import Tool

READ_PARTS = ("summary", "links", "joints", "files")
"""Parts of an asset for ``read_asset``."""
LINK_FIELDS = ("name", "material", "mass_kg", "com", "inertia")
"""Link fields of ``set_parameters``."""
JOINT_FIELDS = ("name", "damping", "friction", "stiffness", "spring_rest", "holds")
"""Joint fields of ``set_parameters``: terms of a URDF, not the ones from which our rules derive them, and whether the
hold check applies."""


def _object(properties: dict[str, Any], required: tuple[str, ...] = ()) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "required": list(required), "additionalProperties": False}


def _numbers(count: int, description: str) -> dict[str, Any]:
    items = {"type": "number"}
    return {"type": "array", "items": items, "minItems": count, "maxItems": count, "description": description}


def _number(description: str, *, positive: bool = False, signed: bool = False) -> dict[str, Any]:
    bound: dict[str, Any] = {} if signed else {"exclusiveMinimum": 0} if positive else {"minimum": 0}
    return {"type": "number", **bound, "description": description}


_LINK = _object(
    {
        "name": {"type": "string"},
        "material": {"type": "string"},
        "mass_kg": _number("kg", positive=True),
        "com": _numbers(3, "centre of mass in the link's own frame at the final scale, m"),
        "inertia": _numbers(6, "ixx, ixy, ixz, iyy, iyz, izz about the centre of mass, kg·m²"),
    },
    ("name",),
)

_JOINT = _object(
    {
        "name": {"type": "string"},
        "damping": _number("N·m·s/rad, or N·s/m for a prismatic joint"),
        "friction": _number("N·m, or N for a prismatic joint"),
        "stiffness": _number("N·m/rad, or N/m for a prismatic joint"),
        "spring_rest": _number("position to which a spring returns, rad, or m at scale 1", signed=True),
        "holds": {"type": "boolean", "description": "whether the part must stay wherever it is put"},
    },
    ("name",),
)

_START = _object(
    {"joint": {"type": "string"}, "position": _number("rad, or m at scale 1 for a prismatic joint", signed=True)},
    ("joint", "position"),
)

TOOLS: tuple[Tool, ...] = (
    Tool(
        name="read_asset",
        description="Read the asset as plain text: a summary, its links (boxes, volumes), its joints (limits), or its "
        "files. Lengths are metres at scale 1.",
        parameters=_object(
            {
                "part": {"type": "string", "enum": list(READ_PARTS)},
                "start": {"type": "integer", "minimum": 0, "description": "first row, where a reading is long"},
            },
            ("part",),
        ),
    ),
    Tool(
        name="render",
        description="Look at the object with the present parameters, in its initial state: pictures of these views, "
        "and every link's box in the world. Without views: all of them.",
        parameters=_object(
            {"views": {"type": "array", "items": {"type": "string", "enum": list(VIEW_NAMES)}, "minItems": 1}}
        ),
    ),
    Tool(
        name="set_parameters",
        description="Set parameters. What is named replaces what was set before, field by field; all else stays. "
        "Positions are where joints start.",
        parameters=_object(
            {
                "scale": _number("real size over authored size, for the whole object", positive=True),
                "contact_material": {"type": "string"},
                "links": {"type": "array", "items": _LINK},
                "joints": {"type": "array", "items": _JOINT},
                "initial_joint_positions": {"type": "array", "items": _START},
            }
        ),
    ),
    Tool(
        name="simulate",
        description="Put the object on a plane in PyBullet with the present parameters, let it settle, and watch it "
        "untouched: overlap in the initial state, drift of the root, oscillation of joints.",
        parameters=_object({}),
    ),
    Tool(
        name="read_contacts",
        description="List the pairs of links that overlap in the initial state, deepest first.",
        parameters=_object({}),
    ),
    Tool(
        name="finish",
        description="End: the present parameters are what you propose.",
        parameters=_object({"notes": {"type": "string"}}),
    ),
)
"""All tools, in the order sent to the model."""
TOOL_NAMES = tuple(tool.name for tool in TOOLS)


def argument_names(name: str) -> tuple[str, ...]:
    """The names of a tool's arguments."""
    return next(tuple(tool.parameters["properties"]) for tool in TOOLS if tool.name == name)


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
