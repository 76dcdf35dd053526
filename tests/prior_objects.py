"""Objects as a prompt describes them, stated by hand: sizes in m, z up, front towards −x."""

import json
from typing import Any

from asset2sim.models.prior.answer import answer

Json = dict[str, Any]


def link(name: str, label: str = "", at: tuple[float, float, float] = (0.0, 0.0, 0.0), size: float = 0.5) -> Json:
    """A cube of this size, m, whose volume is that of its hull."""
    return {
        "name": name, "label": label, "joint_kind": "", "box_m": [size] * 3, "center_m": list(at),
        "volume_m3": size**3, "hull_volume_m3": size**3, "volume_source": "hull", "area_m2": 6 * size**2,
        "outer_m2": 6 * size**2, "materials": [], "mass_kg": None,
    }  # fmt: skip


def joint(
    name: str, child: str, kind: str = "revolute", *,
    lower: float = 0.0, upper: float = 1.6, closed: float | None = None,
    parent: str = "body", axis: tuple[float, float, float] = (0.0, 0.0, 1.0), confidence: float = 1.0,
) -> Json:  # fmt: skip
    """A joint that is closed at ``closed`` (its lower end unless stated) and open at the other end."""
    shut = lower if closed is None else closed
    turning = kind == "continuous"
    return {
        "name": name, "type": kind, "parent": parent, "child": child, "axis": list(axis),
        "lower": None if turning else lower, "upper": None if turning else upper,
        "closed": 0.0 if turning else shut, "open": 0.0 if turning else lower + upper - shut,
        "open_confidence": confidence,
    }  # fmt: skip


def thing(category: str, *moving: tuple[Json, Json], asset_id: str = "1", size: float = 1.6, body: str = "") -> Json:
    """An object of a body and its moving (link, joint) pairs."""
    return {
        "purpose": "synthesis", "asset_id": asset_id, "category": category, "size_m": [size] * 3,
        "size_closed_m": [size] * 3, "links": [link("body", body, size=size), *(pair[0] for pair in moving)],
        "joints": [pair[1] for pair in moving],
    }  # fmt: skip


def hinged(
    name: str, label: str, at: tuple[float, float, float] = (0.0, 0.0, 0.0), **joint_fields: Any
) -> tuple[Json, Json]:
    """A hinged part called ``name``; its joint is called the same."""
    return link(f"{name}_link", label, at), joint(name, f"{name}_link", **joint_fields)


def sliding(
    name: str, label: str, at: tuple[float, float, float] = (0.0, 0.0, 0.0), **joint_fields: Any
) -> tuple[Json, Json]:
    """A sliding part that opens towards −x by 0.5 m unless stated otherwise."""
    fields = {"upper": 0.5, "axis": (-1.0, 0.0, 0.0), **joint_fields}
    return link(f"{name}_link", label, at), joint(name, f"{name}_link", "prismatic", **fields)


def spinning(name: str, label: str) -> tuple[Json, Json]:
    """A part that turns without limits."""
    return link(f"{name}_link", label, size=0.1), joint(name, f"{name}_link", "continuous")


def prompt(information: Any, guidance: Any) -> str:
    """The user's part of a prompt."""
    return (
        f"<structured_information>\n{json.dumps(information)}\n</structured_information>\n\n"
        f"<user_guidance>\n{json.dumps(guidance)}\n</user_guidance>"
    )


def ask(information: Json, guidance: str = "") -> Json:
    """The parsed answer."""
    parsed: Json = json.loads(answer(prompt(information, guidance)))
    return parsed


def felt(overlay: Json, name: str) -> Json:
    """The answer's entry for one joint."""
    found: Json = next(item for item in overlay["joints"] if item["name"] == name)
    return found


BOX = thing("Box", hinged("lid", "rotation_lid", lower=-1.0, upper=2.0), body="box_body")
LAPTOP = thing("Laptop", hinged("screen", "screen", lower=-1.8, upper=0.9), body="laptop_base")
MICROWAVE = thing(
    "Microwave", hinged("door", "door"), spinning("tray", "rotation_tray"), spinning("knob", "knob"),
    sliding("button", "button", lower=0.0, upper=0.01), body="microwave_body",
)  # fmt: skip
TOILET = thing(
    "Toilet", hinged("lid", "lid"), hinged("seat", "seat"), hinged("lever", "lever", upper=0.5),
    sliding("pump", "pump_lid", upper=0.01),
)  # fmt: skip
CABINET = thing(
    "StorageFurniture",
    hinged("door_left", "rotation_door", (-0.8, 0.4, -0.2)), hinged("door_right", "rotation_door", (-0.8, -0.4, -0.2)),
    sliding("drawer_left", "drawer", (-0.5, 0.4, 0.6)), sliding("drawer_right", "drawer", (-0.5, -0.4, 0.6)),
    body="furniture_body",
)  # fmt: skip
DRAWERS = thing(
    "Table", *(sliding(f"d{row}", "drawer", (-0.5, 0.0, 0.6 - 0.6 * row)) for row in (2, 0, 1)), body="furniture_body"
)
SUITCASE = thing(
    "Suitcase",
    hinged("lid", "lid", upper=3.14),
    hinged("handle", "rotation_handle", lower=-1.57, upper=1.57, closed=1.57),
)
BUCKET = thing("Bucket", hinged("handle", "handle", lower=-2.0, upper=2.0), body="bucket_body")
SAFE = thing("Safe", hinged("door", "door", upper=3.0), spinning("knob", "knob"), body="safe_body")
STAPLER = thing(
    "Stapler",
    (link("lid_link", "lid"), joint("lid", "lid_link", lower=-0.3, upper=2.0)),
    (link("magazine", "stapler_body"), joint("inner", "magazine", parent="lid_link", lower=-0.1, upper=2.8)),
    body="stapler_base",
)
TOASTER = thing(
    "Toaster", sliding("lever", "slider", axis=(0.0, 0.0, -1.0), upper=0.4, closed=0.4), spinning("knob", "knob")
)
GLASSES = thing(
    "Eyeglasses",
    hinged("left", "leg", (0.0, 0.6, 0.0), closed=1.6),
    hinged("right", "leg", (0.0, -0.6, 0.0), closed=1.6),
)
SCISSORS = thing("Scissors", hinged("halves", "leg", lower=-0.6, upper=0.0), body="leg")
TRASHCAN = thing("TrashCan", hinged("lid", "lid", upper=3.14), spinning("wheel", "wheel"), hinged("pedal", "foot_pad"))
KEYBOARD = thing("Keyboard", *(sliding(f"k{i}", "key", upper=0.01, axis=(0.0, 0.0, -1.0)) for i in range(3)))
BOTTLE = thing("Bottle", hinged("cap", "rotation_lid", upper=3.14, closed=3.14, confidence=0.0))
