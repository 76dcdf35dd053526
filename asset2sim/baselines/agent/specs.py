"""The agent's tools as a model is told of them: names, what they do, and the JSON Schema of their arguments."""

from typing import Any

from asset2sim.assets.views import VIEW_NAMES
from schemas.request import Tool

READ_PARTS = ("summary", "links", "joints", "files")
"""What ``read_asset`` can read."""
LINK_FIELDS = ("name", "material", "mass_kg", "com", "inertia")
"""What ``set_parameters`` takes of a link ..."""
JOINT_FIELDS = ("name", "damping", "friction", "stiffness", "spring_rest", "holds")
"""... and of a joint: what a URDF can hold, nothing from which a rule of ours would derive it, and whether the joint is
to be judged by whether it stays where it is put."""


def _object(properties: dict[str, Any], required: tuple[str, ...] = ()) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
    }


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
    {
        "joint": {"type": "string"},
        "position": _number("rad, or m at scale 1 for a prismatic joint", signed=True),
    },
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
"""All tools, in the order in which a model is told of them."""
TOOL_NAMES = tuple(tool.name for tool in TOOLS)


def argument_names(name: str) -> tuple[str, ...]:
    """The names of a tool's arguments."""
    return next(tuple(tool.parameters["properties"]) for tool in TOOLS if tool.name == name)


MAX_ANSWER_CALLS = 8
"""Tool calls of one answer that are run; the rest is dropped and the model told so."""
MAX_CALLS = 60
"""Tool calls for one asset: five for each of the twelve answers of the default budget."""
MAX_SAME = 3
"""Identical answers in a row that end the conversation: the tools would return the same for ever."""
MAX_ARGUMENT_CHARS = 100_000
"""Longest arguments of one call that are looked at: an object of a thousand joints needs less."""
MAX_RESULT_CHARS = 16_000
"""Longest result of one tool, about 4000 tokens."""
MAX_SAID_CHARS = 4_000
"""Longest text of the model's own that goes back to it with the conversation."""
MAX_TALK_CHARS = 160_000
"""Longest conversation, about 40,000 tokens; beyond it the oldest results and arguments are left out."""
MAX_ROOMLESS_CHARS = 200
"""Arguments up to this length stay even then."""
MAX_ID_CHARS = 20_000
"""Longest identifier of a call that is kept: some providers put their model's signed thoughts into it."""
MAX_QUOTED_CHARS = 200
"""How much of something wrong is quoted in an error."""
MAX_ROWS = 40
"""Joints, links or pairs that one result lists."""
MAX_NOTES = 10
"""Notes that are kept of what the model says when it finishes ..."""
MAX_NOTE_CHARS = 500
"""... and the longest of them."""
TOOL_LIMIT_S = 60.0
"""Wall time of one simulation, rendering or reading of contacts, s; its process is killed then."""
TOOL_SHARE = 0.5
"""Share of the asset's time limit that all tools together may take: the rest is for the judgement."""
MIN_TOOL_S = 1.0
"""With less time left than this, s, no tool is started."""
