"""Electric devices: a microwave, a laptop and a keyboard."""

from tests.samples.blueprint import GAP, Blueprint, Finish, Link, hinge, pieces, slider, turntable
from tests.samples.shapes import Mesh, block, disc, frustum, shell

WHITE = Finish((0.88, 0.88, 0.86))
GREY = Finish((0.45, 0.46, 0.48))
SILVER = Finish((0.72, 0.73, 0.75))
BLACK = Finish((0.1, 0.1, 0.11))
GLASS = Finish((0.2, 0.25, 0.28), alpha=0.5)
PLATE = Finish((0.75, 0.85, 0.88), alpha=0.8)
SCREEN = Finish((0.12, 0.24, 0.5))
GREEN = Finish((0.2, 0.85, 0.4))
KEY = Finish((0.93, 0.92, 0.88))
ACCENT = Finish((0.55, 0.62, 0.72))


def microwave() -> Blueprint:
    """A microwave with its door on the left, one knob and a turning tray."""
    feet = [block((x, 0.0, z), (x + 0.1, 0.04, z + 0.1)) for x in (-0.75, 0.65) for z in (-0.45, 0.3)]
    body = (
        *pieces("frame", WHITE, shell((-0.8, 0.04, -0.5), (0.8, 0.9, 0.43), 0.05, without="front")),
        *pieces("divider", WHITE, block((0.42, 0.09, -0.45), (0.46, 0.85, 0.43))),
        *pieces("panel", GREY, block((0.46, 0.09, 0.38), (0.75, 0.85, 0.43))),
        *pieces("display", GREEN, block((0.51, 0.7, 0.43), (0.7, 0.79, 0.436))),
        *pieces("foot", BLACK, feet),
    )
    door = (
        *pieces("door_frame", WHITE, _frame(-0.8, 0.44, 0.05, 0.89, 0.464, 0.53, 0.12)),
        *pieces("window", GLASS, block((-0.68, 0.17, 0.48), (0.32, 0.77, 0.51))),
        *pieces("handle", GREY, block((0.36, 0.2, 0.57), (0.4, 0.74, 0.61))),
        *pieces("handle", GREY, [block((0.36, y, 0.53), (0.4, y + 0.05, 0.57)) for y in (0.22, 0.67)]),
    )
    knob = (
        *pieces("knob", SILVER, disc("z", (0.605, 0.34, 0.43 + GAP), (0.1, 0.085), 0.07)),
        *pieces("mark", BLACK, block((0.595, 0.35, 0.526), (0.615, 0.42, 0.535))),
    )
    tray = (
        *pieces("tray", PLATE, disc("y", (-0.165, 0.145, -0.02), (0.35, 0.37), 0.025, 28)),
        *pieces("hub", GREY, disc("y", (-0.165, 0.09 + GAP, -0.02), 0.07, 0.028, 12)),
    )
    parts = (
        Link("door", "door", door, hinge("body", (-0.785, 0.0, 0.505), (0.0, -1.0, 0.0), 1.57)),
        Link("knob", "knob", knob, turntable("body", (0.605, 0.34, 0.45), (0.0, 0.0, 1.0))),
        Link("tray", "rotation_tray", tray, turntable("body", (-0.165, 0.1, -0.02), (0.0, 1.0, 0.0))),
        Link("body", "microwave_body", body, kind="heavy"),
    )
    prompt = "I want a microwave with its door halfway open. Low damping for hinge-like behaviour."
    return Blueprint("microwave_kitchen", "Microwave", prompt, parts)


def laptop() -> Blueprint:
    """A laptop, authored with the screen 1.7 rad open as the real ones are."""
    barrels = [disc("x", (x, 0.1, -0.5), 0.02, 0.16, 12) for x in (-0.5, 0.34)]
    tongues = [block((x, 0.04, -0.51), (x + 0.16, 0.08, -0.45)) for x in (-0.5, 0.34)]
    rows = [block((-0.57, 0.07, -0.3 + 0.1 * i), (0.57, 0.08, -0.22 + 0.1 * i)) for i in range(4)]
    base = (
        *pieces("frame", SILVER, block((-0.65, 0.0, -0.45), (0.65, 0.07, 0.45))),
        *pieces("hinge", GREY, [*barrels, *tongues]),
        *pieces("keyboard", BLACK, rows),
        *pieces("touchpad", GREY, block((-0.18, 0.07, 0.16), (0.18, 0.074, 0.4))),
    )
    low = 0.08 + GAP
    bezel = [block((-0.65, low, z0), (0.65, low + 0.014, z1)) for z0, z1 in ((-0.45, -0.39), (0.4, 0.45))]
    bezel += [block((x0, low, -0.39), (x1, low + 0.014, 0.4)) for x0, x1 in ((-0.65, -0.6), (0.6, 0.65))]
    screen = (
        *pieces("screen_back", SILVER, block((-0.65, low + 0.014, -0.45), (0.65, low + 0.035, 0.45))),
        *pieces("bezel", BLACK, bezel),
        *pieces("display", SCREEN, block((-0.6, low + 0.006, -0.39), (0.6, low + 0.014, 0.4))),
    )
    joint = hinge("base", (0.0, 0.1, -0.5), (-1.0, 0.0, 0.0), 2.3, authored=1.7)
    parts = (Link("screen", "screen", screen, joint), Link("base", "laptop_base", base))
    prompt = "I want a slightly open laptop. Low damping for smooth operation."
    return Blueprint("laptop_silver", "Laptop", prompt, parts)


def keyboard() -> Blueprint:
    """A small keyboard of 20 keys, each on a slider of its own that goes down by 0.03."""
    rows = ([1.0] * 6, [1.5, 1.0, 1.0, 1.0, 1.5], [1.0, 1.0, 1.0, 1.0, 1.0, 1.0], [1.5, 3.0, 1.5])
    left, pitch, front = -0.78, 0.26, -0.32
    keys: list[Link] = []
    for row, widths in enumerate(rows):
        x, z = left, front + 0.16 * row
        for width in widths:
            low = (x + GAP / 2, 0.12, z + GAP / 2)
            high = (x + width * pitch - GAP / 2, 0.2, z + 0.16 - GAP / 2)
            paint = KEY if width == 1.0 else ACCENT
            cap = pieces("key", paint, frustum(low, high, 0.02))
            keys.append(Link(f"key_{len(keys)}", "key", cap, slider("base", (0.0, -1.0, 0.0), 0.03)))
            x += width * pitch
    rim_x, rim_z = 0.78 + GAP, 0.32 + GAP
    sides = [block((x, 0.06, -rim_z), (x + 0.05, 0.15, rim_z)) for x in (-rim_x - 0.05, rim_x)]
    ends: list[Mesh] = [block((-rim_x - 0.05, 0.06, z), (rim_x + 0.05, 0.15, z + 0.05)) for z in (-rim_z - 0.05, rim_z)]
    plate = block((-rim_x - 0.05, 0.0, -rim_z - 0.05), (rim_x + 0.05, 0.06, rim_z + 0.05))
    base = Link("base", "keyboard_base", (*pieces("frame", GREY, plate), *pieces("rim", GREY, [*sides, *ends])))
    prompt = "A standard keyboard with light, spring-like keys."
    return Blueprint("keyboard_compact", "Keyboard", prompt, (*keys, base))


def _frame(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float, width: float) -> list[Mesh]:
    uprights = [block((x, y0, z0), (x + width, y1, z1)) for x in (x0, x1 - width)]
    return uprights + [block((x0 + width, y, z0), (x1 - width, y + width, z1)) for y in (y0, y1 - width)]
