"""Furniture: a desk cabinet with two drawers, a sideboard with a door and a drawer, and a folding chair."""

from tests.samples.blueprint import GAP, Blueprint, Finish, Link, NamedMesh, hinge, pieces, slider
from tests.samples.shapes import Mesh, block, shell, tube

WOOD = Finish((0.68, 0.48, 0.28), texture="wood")
BIRCH = Finish((0.82, 0.7, 0.52))
WHITE = Finish((0.9, 0.9, 0.88))
STEEL = Finish((0.7, 0.71, 0.73))
GREY = Finish((0.32, 0.34, 0.38))
BLUE = Finish((0.16, 0.3, 0.52))


def drawer(x: float, y0: float, y1: float, back: float, front: float, paint: Finish) -> tuple[NamedMesh, ...]:
    """A drawer, open on top, ``GAP`` narrower than its bay on every side, behind a wider front with a handle. ``x`` is
    half the bay's inner width, ``y0`` and ``y1`` its floor and ceiling, ``front`` the carcass's edge."""
    face = front + GAP
    tub = shell((-x + GAP, y0 + GAP, back + GAP), (x - GAP, y1 - 0.1, face), 0.03, without="top")
    low, high = (y0 + y1) / 2.0 - 0.02, (y0 + y1) / 2.0 + 0.02
    bars = [block((-0.15, low, face + 0.08), (0.15, high, face + 0.11))]
    bars += [block((end, low, face + 0.04), (end + 0.03, high, face + 0.08)) for end in (-0.15, 0.12)]
    panel = pieces("drawer_front", paint, block((-x - 0.04, y0 - 0.01, face), (x + 0.04, y1 + 0.01, face + 0.04)))
    return (*pieces("drawer_box", BIRCH, tub), *panel, *pieces("handle", STEEL, bars))


def desk_cabinet() -> Blueprint:
    """A two-drawer cabinet for under a desk; the first drawer is the upper one."""
    body = (
        *pieces("frame", WOOD, shell((-0.45, 0.05, -0.5), (0.45, 1.2, 0.42), 0.05, without="front")),
        *pieces("shelf", BIRCH, block((-0.4, 0.6, -0.45), (0.4, 0.65, 0.42))),
        *pieces("plinth", GREY, block((-0.42, 0.0, -0.46), (0.42, 0.05, 0.38))),
    )
    parts = (
        Link("upper", "drawer", drawer(0.4, 0.65, 1.15, -0.45, 0.42, WOOD), slider("body", (0.0, 0.0, 1.0), 0.7)),
        Link("lower", "drawer", drawer(0.4, 0.1, 0.6, -0.45, 0.42, WOOD), slider("body", (0.0, 0.0, 1.0), 0.7)),
        Link("body", "furniture_body", body, kind="heavy"),
    )
    prompt = "A two-drawer cabinet, first drawer closed and the second slightly open, low friction slides."
    return Blueprint("table_two_drawers", "Table", prompt, parts)


def sideboard() -> Blueprint:
    """A sideboard: one door over one drawer."""
    legs = [block((x, 0.0, z), (x + 0.07, 0.15, z + 0.07)) for x in (-0.53, 0.46) for z in (-0.38, 0.27)]
    body = (
        *pieces("frame", WHITE, shell((-0.55, 0.15, -0.4), (0.55, 1.25, 0.36), 0.05, without="front")),
        *pieces("shelf", WHITE, block((-0.5, 0.5, -0.35), (0.5, 0.55, 0.36))),
        *pieces("leg", BIRCH, legs),
    )
    face = 0.36 + GAP
    door = (
        *pieces("door", BLUE, block((-0.54, 0.55, face), (0.54, 1.24, face + 0.045))),
        *pieces("handle", STEEL, block((0.42, 0.8, face + 0.08), (0.45, 1.0, face + 0.11))),
        *pieces("handle", STEEL, [block((0.42, y, face + 0.045), (0.45, y + 0.03, face + 0.08)) for y in (0.8, 0.97)]),
    )
    swing = hinge("body", (-0.53, 0.0, face + 0.03), (0.0, -1.0, 0.0), 1.57)
    parts = (
        Link("door", "rotation_door", door, swing),
        Link("drawer", "drawer", drawer(0.5, 0.2, 0.5, -0.35, 0.36, BLUE), slider("body", (0.0, 0.0, 1.0), 0.6)),
        Link("body", "furniture_body", body, kind="heavy"),
    )
    prompt = "A small sideboard with its door fully open and the drawer closed, medium friction."
    return Blueprint("storage_sideboard", "StorageFurniture", prompt, parts)


def folding_chair() -> Blueprint:
    """A folding chair, standing; its seat folds up between the legs."""
    bars: list[Mesh] = []
    for x in (-0.42, 0.42):
        bars += tube([(x, 0.0, 0.42), (x, 0.62, 0.08), (x, 1.35, -0.32)], (1.0, 0.0, 0.0), 0.03, 8)
    for x in (-0.36, 0.36):
        bars += tube([(x, 0.0, -0.42), (x, 0.7, 0.2)], (1.0, 0.0, 0.0), 0.028, 8)
    cross = [block((-0.42, 0.1, 0.35), (0.42, 0.14, 0.39)), block((-0.36, 0.1, -0.35), (0.36, 0.14, -0.31))]
    body = (*pieces("leg", GREY, bars), *pieces("bar", GREY, cross), *pieces("back", BLUE, _slats()))
    seat = (
        *pieces("seat", BLUE, block((-0.3, 0.575, -0.33), (0.3, 0.605, 0.37))),
        *pieces("seat_rail", GREY, [block((x, 0.545, -0.3), (x + 0.03, 0.575, 0.34)) for x in (-0.3, 0.27)]),
    )
    joint = hinge("body", (0.0, 0.59, 0.09), (-1.0, 0.0, 0.0), 1.1)
    prompt = "I want a very small folding chair for a baby, easy to fold, with its seat unfolded in normal position."
    parts = (Link("seat", "seat", seat, joint), Link("body", "leg", body))
    return Blueprint("chair_folding", "FoldingChair", prompt, parts)


def _slats() -> list[Mesh]:
    # Two slats between the uprights, upright themselves, at the depth to which the uprights lean at that height.
    depths = {low: -0.32 + (1.35 - low - 0.06) * 0.548 for low in (1.0, 1.18)}
    return [block((-0.4, low, z - 0.012), (0.4, low + 0.12, z + 0.012)) for low, z in depths.items()]
