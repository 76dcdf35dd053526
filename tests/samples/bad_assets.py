"""Bad assets, each a good one with one defect, and their expected outcomes. The asset's id names the defect, not its
prompt: a prompt is read as guidance, and the words "open mesh" would ask for something open."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from schemas.vocabulary import FailureMode
from tests.samples.blueprint import GAP, Blueprint, Finish, Link, NamedMesh, hinge, pieces, slider
from tests.samples.layout import asset_files
from tests.samples.objects.boxes import BRASS, box_body, box_lid
from tests.samples.objects.devices import laptop
from tests.samples.objects.furniture import drawer
from tests.samples.shapes import Mesh, block, shell

Files = dict[str, bytes]
CARD = Finish((0.72, 0.56, 0.38))
PICTURE = Finish((0.3, 0.36, 0.48), texture="canvas")
GREEN = Finish((0.36, 0.5, 0.4))


@dataclass(frozen=True)
class BadAsset:
    """A bad asset: its ``blueprint``, the failure modes with which it may end, and the change ``spoil`` to its files.
    ``FailureMode.NONE`` among ``outcomes`` means that its refinement may succeed, or must if it is the only one."""

    blueprint: Blueprint
    outcomes: tuple[FailureMode, ...]
    spoil: Callable[[Files], Files] = dict

    def files(self) -> Files:
        """The asset's files, with the defect."""
        return self.spoil(asset_files(self.blueprint))


def bad_assets() -> tuple[BadAsset, ...]:
    """Every planted asset, in the manifest's order."""
    good, mode = FailureMode.NONE, FailureMode
    return (
        BadAsset(open_mesh(), (good,)),
        BadAsset(flat_decal(), (good,)),
        BadAsset(_box("planted_missing_mesh", "A small box with its lid halfway open."), (good,), _without(2)),
        BadAsset(_missing_screen(), (mode.MISSING_MESH,), _without(1)),
        BadAsset(crossed_flaps(), (good,)),
        BadAsset(blocked_drawer(), (mode.PENETRATION,)),
        BadAsset(inverted_limits(), (good, mode.INVALID_JOINT_CONFIGURATION)),
        BadAsset(_box("planted_not_xml", "A box with its lid closed."), (mode.UNREADABLE_ASSET,), _not_xml),
    )


def open_mesh() -> Blueprint:
    """A box all of whose pieces lack a face, so that no mesh encloses a volume."""
    parts = tuple(
        replace(part, pieces=tuple(replace(piece, mesh=_opened(piece.mesh)) for piece in part.pieces))
        for part in (box_lid(), box_body())
    )
    return Blueprint("planted_open_mesh", "Box", "A small storage box with its lid slightly open.", parts, "planted")


def flat_decal() -> Blueprint:
    """A box with a picture on its lid: one quad, coplanar, among the visuals and the collision shapes."""
    top = 0.75 + GAP + 0.051
    corners = np.array([(-0.4, top, -0.25), (0.4, top, -0.25), (0.4, top, 0.25), (-0.4, top, 0.25)])
    uv = np.array([[(0, 1), (1, 0), (1, 1)], [(0, 1), (0, 0), (1, 0)]], dtype=float)
    quad = Mesh(corners, np.array([(0, 2, 1), (0, 3, 2)]), uv)
    parts = (box_lid((NamedMesh("decal", quad, PICTURE),)), box_body())
    return Blueprint("planted_flat_decal", "Box", "A gift box with its lid a little open.", parts, "planted")


def inverted_limits() -> Blueprint:
    """A box whose lid has its lower limit over its upper one."""
    parts = (box_lid(lower=1.8, upper=-0.2), box_body())
    return Blueprint("planted_inverted_limits", "Box", "A small box, lid fully open.", parts, "planted")


def crossed_flaps() -> Blueprint:
    """A carton whose two flaps are each longer than half of it: closed together, they run through each other. Lifting
    one by 0.1 rad, within a tenth of its range, lays it over the other."""
    low = 0.6 + GAP
    flaps = []
    for key, sign in (("left", -1.0), ("right", 1.0)):
        near, far = sorted((sign * 0.7, sign * -0.12))
        panel = pieces("flap", CARD, block((near, low, -0.45), (far, low + 0.03, 0.45)))
        joint = hinge("body", (sign * 0.73, low, 0.0), (0.0, 0.0, -sign), 2.4)
        flaps.append(Link(key, "rotation_lid", panel, joint))
    tape = pieces("tape", GREEN, block((-0.08, 0.1, 0.45), (0.08, 0.45, 0.452)))
    carton = pieces("frame", CARD, shell((-0.7, 0.0, -0.45), (0.7, 0.6, 0.45), 0.03, without="top"))
    parts = (*flaps, Link("body", "box_body", carton + tape))
    return Blueprint("planted_crossed_flaps", "Box", "A small shipping box with both lids closed.", parts, "planted")


def blocked_drawer() -> Blueprint:
    """A cabinet whose door covers the drawer: no state has the door closed and the drawer halfway out."""
    body = (
        *pieces("frame", GREEN, shell((-0.45, 0.0, -0.5), (0.45, 0.8, 0.6), 0.05, without="front")),
        *pieces("shelf", GREEN, block((-0.4, 0.36, -0.45), (0.4, 0.41, 0.3))),
    )
    # The drawer's bay ends inside the cabinet; its front is narrower than the bay so that it can pass the side walls.
    tub = drawer(0.33, 0.09, 0.32, -0.45, 0.3, CARD)
    face = 0.6 + GAP
    door = (
        *pieces("door", GREEN, block((-0.44, 0.01, face), (0.44, 0.79, face + 0.045))),
        *pieces("handle", BRASS, block((0.34, 0.34, face + 0.045), (0.38, 0.46, face + 0.09))),
    )
    swing = hinge("body", (-0.43, 0.0, face + 0.03), (0.0, -1.0, 0.0), 1.9)
    parts = (
        Link("drawer", "drawer", tub, slider("body", (0.0, 0.0, 1.0), 0.7)),
        Link("door", "rotation_door", door, swing),
        Link("body", "furniture_body", body, kind="heavy"),
    )
    prompt = "A small cabinet with its door closed and the drawer behind it halfway open."
    return Blueprint("planted_blocked_drawer", "StorageFurniture", prompt, parts, "planted")


def _box(asset_id: str, prompt: str) -> Blueprint:
    return Blueprint(asset_id, "Box", prompt, (box_lid(authored=0.5), box_body()), "planted")


def _missing_screen() -> Blueprint:
    source = laptop()
    screen, base = source.parts
    # The screen keeps one mesh, whose file is then removed.
    parts = (replace(screen, pieces=screen.pieces[:1]), base)
    prompt = "I want a laptop with its screen halfway open."
    return replace(source, asset_id="planted_missing_link", prompt=prompt, parts=parts, subset="planted")


def _opened(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces[2:], None if mesh.uv is None else mesh.uv[2:])


def _without(mesh: int) -> Callable[[Files], Files]:
    # Mesh 1 of the laptop is its screen, mesh 2 of the box its lid's latch.
    return lambda files: {name: data for name, data in files.items() if name != f"textured_objs/original-{mesh}.obj"}


def _not_xml(files: Files) -> Files:
    return {**files, "mobility.urdf": b"robot: box\nlinks: [base, link_0, link_1]\nthis is not XML\n"}
