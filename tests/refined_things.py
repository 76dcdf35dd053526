"""Small refined objects of boxes, as a run writes them, for tests that load them."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.support import Support, SupportKind
from schemas.vocabulary import Source
from tests.assets import joint, link, robot, shape, written
from tests.factories import make_joint, make_link

FRICTION_N, DAMPING, OPEN_M = 2.0, 5.0, 0.06
"""Of the drawer's slide: dry friction, N, damping, N·s/m, and how far it is out, m."""


def inertial(mass: float, size: float) -> str:
    moment = mass * size**2 / 6.0
    return (
        f'<inertial><mass value="{mass}"/>'
        f'<inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def refined(
    folder: Path, urdf: str, joints: Sequence[JointPhysics], masses: dict[str, float], *, fixed: bool = True
) -> Path:
    """A refined folder."""
    overlay = PhysicsOverlay(
        asset_id=folder.name, scale=1.0, scale_source=Source.USER, contact_friction=0.8,
        links=tuple(make_link(name, mass) for name, mass in masses.items()), joints=tuple(joints),
        support=Support(kind=SupportKind.FIXED if fixed else SupportKind.FREESTANDING),
    )  # fmt: skip
    written(folder, urdf)
    (folder / "overlay.json").write_text(json.dumps(overlay.model_dump(mode="json")), encoding="utf-8")
    return folder


class Solid(NamedTuple):
    """A link: its shapes, its mass, kg, and the edge of the cube as which it turns, m."""

    shapes: str
    mass: float
    size: float

    def link(self, name: str) -> str:
        return link(name, self.shapes + inertial(self.mass, self.size))


BODY, FRONT = Solid(shape("0.2 0.2 0.16", xyz="0 0 0.08"), 3.0, 0.2), Solid(shape("0.02 0.18 0.1"), 0.3, 0.1)


def two(
    folder: Path, body: Solid, part: Solid, kind: str, place: str, axis: str, upper: float | None, *,
    names: tuple[str, str] = ("part", "joint"), start: float = 0.0, fixed: bool = False, **terms: Any,
) -> Path:  # fmt: skip
    """A refined folder of a body and one part that moves from 0 to ``upper``, or for ever; ``terms`` of its joint."""
    name, moves = names
    limit = None if upper is None else f"0 {upper}"
    urdf = robot(
        body.link("body"), part.link(name), joint(moves, kind, "body", name, xyz=place, axis=axis, limit=limit)
    )
    own = make_joint(moves, kind, start).model_copy(update={"upper": upper, "open": upper or 1.0, **terms})
    return refined(folder, urdf, [own], {"body": body.mass, name: part.mass}, fixed=fixed)


def drawer(folder: Path) -> Path:
    """A block with a front that slides out along x, and is ``OPEN_M`` out."""
    return two(folder, BODY, FRONT, "prismatic", "0.112 0 0.09", "1 0 0", 0.1, names=("front", "slide"), start=OPEN_M,
               fixed=True, friction=FRICTION_N, damping=DAMPING, holds=True)  # fmt: skip


def block(folder: Path, edge: float, mass: float) -> Path:
    """A cube that stands freely."""
    size = f"{edge} {edge} {edge}"
    urdf = robot(link("body", shape(size, xyz=f"0 0 {edge / 2}") + inertial(mass, edge)))
    return refined(folder, urdf, [], {"body": mass}, fixed=False)
