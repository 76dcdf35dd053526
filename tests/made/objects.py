"""Forty-four made objects. Sizes, masses and forces are what a person who handles such things says of them, written down
before the first run and not changed after it."""

import math

from tests.made.shapes import Made, Part, block, hollow, lathe, rod

STANDS, FIXED, HELD = "freestanding", "fixed", "handheld"
UP, DOWN, X, Y = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
PULL_DOOR, PULL_DRAWER, SEALED = (1.0, 40.0), (2.0, 50.0), (5.0, 60.0)


def door(label, width, height, x, y, z, thick=0.018, handle=True, right=False):
    """A leaf in the plane x, its hinge on the left edge (seen from the front, at -x: +y) or on the right."""
    side = -1.0 if right else 1.0
    leaf = [block("door_frame", (thick, width, height), (x, y, z))]
    grip = [block("handle", (0.03, 0.015, 0.12), (x - 0.03, y - side * (width / 2.0 - 0.04), z))] if handle else []
    return Part(label, leaf + grip, "revolute", (x, y + side * width / 2.0, z), (0.0, 0.0, side), (0.0, 1.7))


def drawer(width, height, depth, x, y, z, front=0.018, label="slider drawer"):
    """A tray with a front at x and its knob, sliding out to the front."""
    tray = hollow("drawer_box", (depth, width - 0.03, height - 0.03), (x + depth / 2.0 + front, y, z), 0.01, front=False)
    tray = [block("drawer_box", (depth, width - 0.03, 0.01), (x + depth / 2.0 + front, y, z - height / 2.0 + 0.02)), *tray[:2]]
    knob = block("handle", (0.025, 0.1, 0.015), (x - 0.02, y, z))
    return Part(label, [block("drawer_front", (front, width, height), (x, y, z)), *tray, knob], "prismatic", (x, y, z),
                (-1.0, 0.0, 0.0), (0.0, 0.8 * depth))  # fmt: skip


def knob(label, radius, x, y, z, turn=(0.0, 4.7), parent=0, along="x"):
    """A knob on the front that turns about the axis it stands out by."""
    axis = {"x": (-1.0, 0.0, 0.0), "y": Y, "z": UP}[along]
    shape = [rod("knob", radius, 0.02, (x, y, z), along), block("knob", (0.022, 0.004, 1.6 * radius), (x - 0.002, y, z))]
    return Part(label, shape, "revolute", (x, y, z), axis, turn, parent)


def tap(lever, body="heavy faucet_base", spout=0.2, height=0.28):
    """A mixer: column, spout to the front, and the given lever."""
    base = [rod("base", 0.025, height, (0, 0, height / 2)), rod("spout", 0.012, spout, (-spout / 2, 0, height - 0.02), "x")]
    return [Part(body, base), lever]


def lever_on(label, z, length=0.11):
    return Part(label, [rod("lever", 0.02, 0.03, (0, 0, z)), rod("lever", 0.007, length, (length / 2, 0, z + 0.01), "x")],
                "revolute", (0, 0, z), Y, (0.0, 0.5))  # fmt: skip


def cross(label, y, z):
    return Part(label, [rod("handle", 0.01, 0.03, (0, y, z)), block("handle", (0.06, 0.01, 0.01), (0, y, z + 0.02)),
                        block("handle", (0.01, 0.06, 0.01), (0, y, z + 0.02))], "revolute", (0, y, z), UP, (0.0, 1.57))  # fmt: skip


def capped(body, cap_label, radius, z, height=0.016, kind="continuous"):
    return [body, Part(cap_label, [rod("cap", radius, height, (0, 0, z))], kind, (0, 0, z), UP, (0.0, 6.28))]


def case(label, size, wall=0.018, z=None, name="cabinet_frame"):
    return Part(label, hollow(name, size, (0, 0, size[2] / 2 if z is None else z), wall))


def cabinet(plinth, name, gap=0.002):
    """A base unit of two doors over a bottom drawer, so high over the floor."""
    body = hollow("cabinet_frame", (0.5, 0.8, 0.85), (0, 0, plinth + 0.425), 0.018)
    foot = [block("foot", (0.42, 0.76, plinth), (0.03, 0, plinth / 2))] if plinth > 0.0 else []
    low = drawer(0.79, 0.2, 0.42, -0.26, 0, plinth + gap + 0.1)
    doors = [door("hinge rotation_door", 0.39, 0.62, -0.26, 0.2, plinth + 0.53),
             door("hinge rotation_door", 0.39, 0.62, -0.26, -0.2, plinth + 0.53, right=True)]  # fmt: skip
    return Made(name, "StorageFurniture", "partnet", [Part("heavy cabinet_frame", body + foot), low, *doors], (60, 130),
                (STANDS,), (14, 60), {}, {1: PULL_DRAWER, 2: PULL_DOOR, 3: PULL_DOOR}, (1, 2, 3))  # fmt: skip


def range_cooker():
    body = hollow("body", (0.6, 0.6, 0.72), (0, 0, 0.54), 0.02)
    body += [block("body", (0.55, 0.6, 0.02), (0.02, 0, 0.01)), block("body", (0.58, 0.02, 0.16), (0.01, 0.29, 0.1)),
             block("body", (0.58, 0.02, 0.16), (0.01, -0.29, 0.1))]  # fmt: skip
    flap = Part("hinge door", [block("door_frame", (0.03, 0.56, 0.45), (-0.32, 0, 0.45)), rod("handle", 0.01, 0.45, (-0.37, 0, 0.62), "y")],
                "revolute", (-0.32, 0, 0.225), (0, -1, 0), (0.0, 1.5))  # fmt: skip
    knobs = [knob("hinge knob", 0.022, -0.315, y, 0.8) for y in (-0.2, -0.07, 0.07, 0.2)]
    return Made("range_with_drawer", "Oven", "partnet", [Part("heavy oven_body", body), flap, drawer(0.56, 0.15, 0.45, -0.31, 0, 0.1), *knobs],
                (80, 105), (STANDS, FIXED), (35, 90), {1: (3, 12)}, {1: (5, 60), 2: PULL_DRAWER, 3: (0.5, 40)}, (2, 3))  # fmt: skip


def sheet_doored(name, category, size, leaf, size_cm, mass, leaf_kg, force, habit="partnet", label="hinge door", support=(STANDS, FIXED)):
    """A carcass whose door is drawn as a sheet of 2 mm, on the front's outside."""
    x, y, z = size
    body = Part(f"heavy {name}_body", hollow("frame", size, (0, 0, z / 2), 0.02))
    flat = door(label, leaf[0], leaf[1], -x / 2 - 0.004, 0, z / 2, thick=0.002, handle=False)
    return Made(name, category, habit, [body, flat], size_cm, support, mass, {1: leaf_kg}, {1: force})


def ladder():
    def frame(sign):
        foot, top = 0.45 * sign, 1.75
        parts = []
        for y in (-0.22, 0.22):
            rail = trimesh_beam((foot, y * (1 + 0.2), 0.0), (0.03 * sign, y, top))
            parts.append(("rail", rail))
        for k in range(1, 6 if sign < 0 else 2):
            share = k / 6.0
            parts.append(rod("rung", 0.014, 0.46, (foot * (1 - share) + 0.03 * sign * share, 0, share * top), "y"))
        return parts

    return Made("step_ladder", "Ladder", "partnet", [Part("heavy ladder_frame", frame(-1.0)), Part("hinge leg", frame(1.0), "revolute",
                (0, 0, 1.75), Y, (0.0, 0.5))], (100, 260), (STANDS, HELD), (3, 14), {}, {1: (0.5, 40)}, (1,))  # fmt: skip


def trimesh_beam(a, b):
    import numpy as np
    import trimesh

    return trimesh.creation.cylinder(0.018, segment=np.array([a, b]), sections=8)


def lamp():
    base = Part("heavy lamp_base", [rod("base", 0.09, 0.025, (0, 0, 0.0125)), rod("stem", 0.01, 0.06, (0, 0, 0.05))])
    arm = Part("hinge arm", [rod("arm", 0.008, 0.25, (0, 0, 0.21))], "revolute", (0, 0, 0.08), Y, (-0.9, 0.9))
    fore = Part("hinge arm", [rod("arm", 0.008, 0.2, (-0.1, 0, 0.34), "x")], "revolute", (0, 0, 0.34), Y, (-0.8, 0.8), 1)
    head = Part("hinge head", [lathe("shade", [(0.02, 0.36), (0.02, 0.34), (0.06, 0.29), (0.062, 0.29), (0.024, 0.36)], (-0.2, 0, 0))],
                "revolute", (-0.2, 0, 0.34), Y, (-0.7, 0.7), 2)  # fmt: skip
    return Made("desk_lamp", "Lamp", "partnet", [base, arm, fore, head], (28, 70), (STANDS,), (0.5, 4), {}, {1: (0.3, 25), 2: (0.2, 25), 3: (0.1, 20)},
                (1, 2, 3))  # fmt: skip


def halves(name, category, label, length, habit, size_cm, mass, force, thick=0.008):
    def half(sign):
        return [block("handle", (0.62 * length, 0.014, thick), (0.3 * length, sign * 0.018, 0.006 + sign * 0.002)),
                block("jaw", (0.35 * length, 0.011, thick), (-0.16 * length, -sign * 0.008, 0.006 + sign * 0.002))]  # fmt: skip

    parts = [Part("free tool_body", half(1.0)), Part(label, half(-1.0), "revolute", (0, 0, 0.006), UP, (-0.3, 0.35))]
    return Made(name, category, habit, parts, size_cm, (HELD, STANDS), mass, {}, {1: force})


def window():
    outer = [block("frame", (0.08, 0.9, 0.05), (0, 0, 0.025)), block("frame", (0.08, 0.9, 0.05), (0, 0, 1.275)),
             block("frame", (0.08, 0.05, 1.2), (0, 0.425, 0.65)), block("frame", (0.08, 0.05, 1.2), (0, -0.425, 0.65))]  # fmt: skip
    pane = [block("window_frame", (0.03, 0.8, 0.04), (-0.02, 0, 0.07)), block("window_frame", (0.03, 0.8, 0.04), (-0.02, 0, 0.63)),
            block("glass", (0.006, 0.78, 0.52), (-0.02, 0, 0.35))]  # fmt: skip
    return Made("sash_window", "Window", "partnet", [Part("heavy window_frame", outer), Part("slider translation_window", pane, "prismatic",
                (-0.02, 0, 0.35), UP, (0.0, 0.55))], (80, 200), (FIXED,), (8, 60), {1: (3, 25)}, {1: (3, 120)}, (1,))  # fmt: skip


def wheelie_bin():
    body = hollow("body", (0.5, 0.46, 0.95), (0, 0, 0.53), 0.02, front=False)
    body = [*body[:4], block("body", (0.02, 0.46, 0.95), (-0.24, 0, 0.53)), block("foot", (0.1, 0.4, 0.06), (-0.18, 0, 0.03))]
    lid = [block("lid", (0.54, 0.5, 0.025), (0, 0, 1.025)), rod("handle", 0.015, 0.4, (0.29, 0, 1.0), "y")]
    wheels = [Part("hinge wheel", [rod("wheel", 0.1, 0.04, (0.2, y, 0.1), "y")], "continuous", (0.2, y, 0.1), Y) for y in (-0.25, 0.25)]
    return Made("wheelie_bin", "TrashCan", "partnet", [Part("heavy container", body), Part("hinge rotation_lid", lid, "revolute", (0.26, 0, 1.02), Y,
                (0.0, 2.2)), *wheels], (85, 130), (STANDS,), (6, 20), {}, {1: (2, 40)})  # fmt: skip


def cart():
    body = hollow("cart_body", (0.4, 0.6, 0.7), (0, 0, 0.48), 0.018)
    casters = [Part("hinge wheel", [rod("wheel", 0.05, 0.025, (x, y, 0.05), "y")], "continuous", (x, y, 0.05), Y)
               for x in (-0.15, 0.15) for y in (-0.25, 0.25)]  # fmt: skip
    forks = [block("fork", (0.03, 0.05, 0.03), (x, y, 0.118)) for x in (-0.15, 0.15) for y in (-0.25, 0.25)]
    return Made("drawer_cart", "Cart", "partnet", [Part("heavy cart_body", body + forks), drawer(0.59, 0.2, 0.34, -0.21, 0, 0.24), drawer(0.59, 0.2, 0.34, -0.21, 0, 0.5), *casters],
                (55, 115), (STANDS,), (6, 40), {}, {1: PULL_DRAWER, 2: PULL_DRAWER}, (1, 2))  # fmt: skip


def box_with_lid(name, category, habit, size, size_cm, mass, force, wall=0.01, support=(STANDS, HELD), label="hinge rotation_lid", handle=False, prompt=""):
    x, y, z = size
    body = hollow("body", (x, y, 0.75 * z), (0, 0, 0.375 * z), wall, front=False)
    body = [*body[:4], block("body", (wall, y, 0.75 * z), (-(x - wall) / 2, 0, 0.375 * z))]
    top = [block("lid", (x, y, wall), (0, 0, z - wall / 2)), block("lid", (wall, y, 0.24 * z), (-(x - wall) / 2, 0, 0.87 * z)),
           block("lid", (x, wall, 0.24 * z), (0, (y - wall) / 2, 0.87 * z)), block("lid", (x, wall, 0.24 * z), (0, -(y - wall) / 2, 0.87 * z))]  # fmt: skip
    top += [block("handle", (0.02, 0.3 * y, 0.02), (0, 0, z + 0.03))] if handle else []
    parts = [Part("heavy box_body", body), Part(label, top, "revolute", (x / 2, 0, 0.75 * z), Y, (0.0, 1.8))]
    return Made(name, category, habit, parts, size_cm, support, mass, {}, {1: force}, (), prompt)


JAR = Part("heavy jar_body", [lathe("body", [(0, 0), (0.037, 0), (0.038, 0.09), (0.032, 0.1), (0.029, 0.1), (0.034, 0.09), (0.033, 0.005), (0, 0.005)])])
BOTTLE = Part("free bottle_body", [lathe("body", [(0, 0), (0.033, 0), (0.033, 0.15), (0.013, 0.2), (0.013, 0.225), (0.012, 0.225), (0.012, 0.2), (0.032, 0.15), (0.032, 0.001), (0, 0.001)])])
PILLS = Part("x pill_bottle_body", [lathe("body", [(0, 0), (0.02, 0), (0.02, 0.065), (0.018, 0.065), (0.018, 0.002), (0, 0.002)])])
PLATE = block("switch_frame", (0.008, 0.085, 0.085), (0, 0, 0.0425))

MADE = (
    Made("mixer_lever", "Faucet", "partnet", tap(lever_on("hinge switch", 0.29)), (18, 45), (FIXED,), (0.5, 4), {}, {1: (1, 25)}, (1,)),
    Made("mixer_named", "Faucet", "akb", tap(lever_on("x faucet_handle", 0.29), "x faucet_body"), (20, 40), (FIXED,), (0.5, 4), {}, {1: (1, 25)}, (1,)),
    Made("basin_taps", "Faucet", "partnet", [Part("heavy faucet_base", [block("base", (0.05, 0.2, 0.02), (0, 0, 0.01)), rod("spout", 0.012, 0.1, (0, 0, 0.07)),
         rod("spout", 0.01, 0.1, (-0.05, 0, 0.12), "x")]), cross("hinge switch", -0.08, 0.035), cross("hinge switch", 0.08, 0.035)],
         (14, 30), (FIXED,), (0.4, 3.5), {}, {1: (1, 40), 2: (1, 40)}, (1, 2)),
    Made("garden_valve", "Faucet", "bare", [Part("b body", [rod("b", 0.013, 0.1, (0.03, 0, 0.06), "x"), rod("b", 0.012, 0.06, (-0.02, 0, 0.04))]),
         Part("s switch", [rod("s", 0.006, 0.04, (0, 0, 0.09)), rod("s", 0.028, 0.008, (0, 0, 0.11))], "revolute", (0, 0, 0.1), UP, (0.0, 12.0))],
         (8, 25), (FIXED,), (0.15, 1.5), {}, {1: (1, 60)}, (1,)),
    Made("water_bottle", "Bottle", "partnet", capped(BOTTLE, "hinge cap", 0.015, 0.228), (15, 33), (STANDS, HELD), (0.015, 0.15), {}, {1: (10, 160)}, (1,)),
    Made("jam_jar", "Jar", "partnet", capped(JAR, "hinge rotation_lid", 0.036, 0.108), (7, 20), (STANDS, HELD), (0.1, 0.6), {}, {1: (10, 160)}, (1,)),
    Made("pill_bottle", "Bottle", "akb", capped(PILLS, "x bottle_cap", 0.022, 0.072, kind="revolute"), (7, 9), (STANDS, HELD), (0.005, 0.06), {}, {1: (5, 120)}, (1,)),
    range_cooker(),
    Made("double_oven", "Oven", "partnet", [Part("heavy oven_body", hollow("body", (0.55, 0.6, 0.62), (0, 0, 0.31), 0.02) + hollow("body", (0.55, 0.6, 0.62), (0, 0, 0.95), 0.02)),
         *(Part("hinge door", [block("door_frame", (0.03, 0.56, 0.5), (-0.292, 0, z)), rod("handle", 0.01, 0.45, (-0.33, 0, z + 0.2), "y")], "revolute",
                (-0.292, 0, z - 0.25), (0, -1, 0), (0.0, 1.5)) for z in (0.31, 0.95))], (105, 150), (FIXED, STANDS), (50, 120), {1: (3, 12)}, {1: (5, 60), 2: (5, 60)}),
    Made("wall_cabinet", "StorageFurniture", "partnet", [Part("heavy cabinet_frame", [*hollow("cabinet_frame", (0.33, 0.8, 0.7), (0, 0, 0.35), 0.018),
         block("hanger", (0.01, 0.7, 0.05), (0.17, 0, 0.65))]), door("hinge rotation_door", 0.395, 0.69, -0.176, 0.2, 0.35),
         door("hinge rotation_door", 0.395, 0.69, -0.176, -0.2, 0.35, right=True)], (50, 110), (FIXED,), (8, 35), {1: (1, 7)}, {1: PULL_DOOR, 2: PULL_DOOR}, (1, 2)),
    Made("safe_sheet", "Safe", "partnet", [case("heavy safe_body", (0.4, 0.4, 0.5), 0.03, name="frame"), door("hinge door", 0.34, 0.44, -0.203, 0, 0.25, 0.002, False),
         Part("hinge handle", [rod("handle", 0.012, 0.03, (-0.22, -0.1, 0.25), "x"), block("handle", (0.012, 0.02, 0.12), (-0.235, -0.1, 0.25))], "revolute", (-0.22, -0.1, 0.25), (-1, 0, 0), (0.0, 1.57), 1),
         knob("hinge knob", 0.03, -0.215, 0.02, 0.32, (0.0, 6.28), 1)], (25, 100), (STANDS, FIXED), (15, 120), {1: (4, 40)}, {1: (1, 60), 2: (1, 60), 3: (0.3, 20)}, (1,)),
    Made("washer_sheet", "WashingMachine", "partnet", [case("heavy washing_machine_body", (0.58, 0.6, 0.85), 0.02, name="frame"),
         Part("hinge door", [rod("door_frame", 0.18, 0.003, (-0.295, 0, 0.42), "x")], "revolute", (-0.295, 0.18, 0.42), UP, (0.0, 2.0)), knob("hinge knob", 0.03, -0.3, 0.15, 0.78)],
         (75, 100), (STANDS,), (40, 95), {1: (0.8, 6)}, {1: (5, 60), 2: (0.3, 15)}),
    box_with_lid("toolbox", "Toolbox", "partnet", (0.22, 0.45, 0.22), (28, 70), (0.8, 7), (0.5, 30), handle=True),
    Made("sewing_machine", "SewingMachine", "partnet", [Part("heavy body", [block("base", (0.18, 0.4, 0.06), (0, 0, 0.03)), block("arm", (0.1, 0.1, 0.2), (0, -0.13, 0.16)), block("arm", (0.09, 0.36, 0.08), (0, 0, 0.28))]),
         Part("hinge wheel", [rod("wheel", 0.04, 0.02, (0, -0.195, 0.26), "y")], "continuous", (0, -0.195, 0.26), Y)], (30, 55), (STANDS,), (4, 14), {}, {1: (0.2, 25)}, (1,)),
    ladder(),
    lamp(),
    window(),
    Made("garage_door", "GarageDoor", "partnet", [Part("heavy door_frame", [block("frame", (0.1, 0.08, 2.2), (0, 1.27, 1.1)), block("frame", (0.1, 0.08, 2.2), (0, -1.27, 1.1)), block("frame", (0.1, 2.62, 0.08), (0, 0, 2.24))]),
         Part("hinge door", [block("door", (0.04, 2.44, 2.15), (0, 0, 1.1)), block("handle", (0.03, 0.12, 0.03), (-0.03, 0, 0.9))], "revolute", (0, 0, 2.15), (0, 1, 0), (0.0, 1.5))],
         (210, 320), (FIXED,), (40, 160), {1: (25, 120)}, {1: (10, 160)}),
    Made("floor_pump", "Pump", "partnet", [Part("heavy pump_body", [rod("tube", 0.018, 0.5, (0, 0, 0.28)), block("foot", (0.12, 0.22, 0.03), (0, 0, 0.015))]),
         Part("slider handle", [rod("rod", 0.006, 0.5, (0, 0, 0.3)), rod("handle", 0.014, 0.24, (0, 0, 0.56), "y")], "prismatic", (0, 0, 0.5), UP, (0.0, 0.42))], (45, 80), (STANDS, HELD), (0.6, 3), {}, {1: (1, 80)}, (1,)),
    halves("pliers", "Pliers", "hinge leg", 0.18, "partnet", (12, 28), (0.08, 0.5), (0.3, 25)),
    halves("pliers_named", "Pliers", "x plier_handle", 0.18, "akb", (15, 20), (0.08, 0.5), (0.3, 25)),
    Made("nail_clippers", "NailClipper", "partnet", [Part("free body", [block("jaw", (0.055, 0.012, 0.002), (0, 0, 0.001)), block("jaw", (0.055, 0.012, 0.002), (0, 0, 0.007)), block("jaw", (0.006, 0.012, 0.006), (0.0245, 0, 0.004))]),
         Part("hinge lever", [block("lever", (0.05, 0.01, 0.002), (0.003, 0, 0.012))], "revolute", (-0.02, 0, 0.011), Y, (0.0, 0.5))], (4, 11), (HELD, STANDS), (0.01, 0.1), {}, {1: (0.1, 30)}),
    Made("umbrella", "Umbrella", "partnet", [Part("free shaft", [rod("shaft", 0.005, 0.85, (0, 0, 0.425)), rod("handle", 0.013, 0.12, (0, 0, 0.05))]),
         Part("slider slider", [rod("runner", 0.01, 0.05, (0, 0, 0.3))], "prismatic", (0, 0, 0.3), UP, (0.0, 0.35))], (55, 110), (HELD, STANDS), (0.15, 1.2), {}, {1: (0.3, 60)}, (1,)),
    Made("upright_piano", "Piano", "partnet", [Part("heavy piano_body", [block("case", (0.35, 1.5, 1.2), (0.15, 0, 0.6)), block("keybed", (0.3, 1.5, 0.12), (-0.17, 0, 0.68)), block("leg", (0.06, 0.06, 0.62), (-0.28, 0.7, 0.31)), block("leg", (0.06, 0.06, 0.62), (-0.28, -0.7, 0.31))]),
         Part("hinge rotation_lid", [block("lid", (0.26, 1.44, 0.02), (-0.17, 0, 0.755))], "revolute", (-0.045, 0, 0.755), Y, (0.0, 1.8))], (120, 170), (STANDS,), (120, 320), {1: (1, 9)}, {1: (2, 45)}),
    Made("baby_gate", "Gate", "partnet", [Part("heavy gate_frame", [rod("post", 0.012, 0.75, (0, -0.4, 0.375)), rod("post", 0.012, 0.75, (0, 0.4, 0.375)), block("rail", (0.025, 0.8, 0.025), (0, 0, 0.0125))]),
         Part("hinge door", [block("rail", (0.02, 0.72, 0.02), (0, 0, 0.06)), block("rail", (0.02, 0.72, 0.02), (0, 0, 0.73)), *(rod("bar", 0.006, 0.66, (0, y, 0.395)) for y in (-0.35, -0.2, -0.05, 0.1, 0.25, 0.35))],
              "revolute", (0, -0.375, 0.4), UP, (0.0, 1.57))], (65, 120), (FIXED, STANDS), (2, 12), {}, {1: (0.5, 30)}),
    Made("wall_mailbox", "Mailbox", "partnet", [case("heavy mailbox_body", (0.1, 0.36, 0.3), 0.003, name="frame"), Part("hinge rotation_lid", [block("lid", (0.11, 0.37, 0.003), (-0.005, 0, 0.305))], "revolute", (0.05, 0, 0.305), Y, (0.0, 1.5))],
         (22, 55), (FIXED, STANDS), (0.7, 6), {}, {1: (0.3, 15)}),
    Made("rocker_switch", "Switch", "partnet", [Part("heavy switch_frame", [PLATE]), Part("hinge button", [block("button", (0.006, 0.05, 0.05), (-0.009, 0, 0.0425))], "revolute", (-0.006, 0, 0.0425), Y, (-0.12, 0.12))],
         (6, 16), (FIXED,), (0.03, 0.25), {}, {1: (1, 12)}, (1,)),
    Made("toggle_named", "Switch", "akb", [Part("x switch_plate", [PLATE]), Part("x toggle", [rod("t", 0.004, 0.02, (-0.014, 0, 0.0425), "x")], "revolute", (-0.004, 0, 0.0425), Y, (-0.4, 0.4))],
         (8, 9.5), (FIXED,), (0.03, 0.25), {}, {1: (1, 15)}, (1,)),
    Made("egg_timer", "Timer", "partnet", [Part("heavy timer_body", [rod("body", 0.033, 0.03, (0, 0, 0.015))]), Part("hinge knob", [rod("knob", 0.033, 0.028, (0, 0, 0.046))], "revolute", (0, 0, 0.045), UP, (0.0, 6.0))],
         (4.5, 12), (STANDS, HELD), (0.04, 0.3), {}, {1: (0.3, 20)}, (1,)),
    wheelie_bin(),
    cabinet(0.0, "cabinet_no_plinth"), cabinet(0.004, "cabinet_plinth_4mm"), cabinet(0.08, "cabinet_plinth_80mm"), cabinet(0.0, "chest_grazing", gap=0.0),
    cart(),
    sheet_doored("fridge_sheet", "Refrigerator", (0.65, 0.6, 1.6), (0.6, 1.58), (130, 200), (35, 95), (5, 25), (8, 45)),
    sheet_doored("microwave_sheet", "Microwave", (0.36, 0.48, 0.28), (0.36, 0.26), (40, 60), (8, 20), (0.5, 3.5), (3, 40), support=(STANDS,)),
    sheet_doored("locker_named", "StorageFurniture", (0.45, 0.38, 1.8), (0.37, 1.77), (175, 185), (12, 50), (2, 14), (1, 40), habit="akb", label="x locker_door"),
    Made("dishwasher_flap", "Dishwasher", "partnet", [case("heavy dishwasher_body", (0.55, 0.6, 0.85), 0.02, name="frame"), Part("hinge door", [block("door_frame", (0.03, 0.59, 0.7), (-0.293, 0, 0.48)), block("handle", (0.02, 0.3, 0.02), (-0.32, 0, 0.78))],
         "revolute", (-0.293, 0, 0.13), (0, -1, 0), (0.0, 1.5))], (78, 95), (STANDS, FIXED), (28, 60), {1: (2.5, 12)}, {1: (5, 60)}),
    Made("laptop_named", "Laptop", "akb", [Part("x laptop_base", [block("b", (0.22, 0.32, 0.014), (0, 0, 0.007))]), Part("x laptop_screen", [block("s", (0.215, 0.31, 0.005), (0, 0, 0.0175))], "revolute", (0.107, 0, 0.016), Y, (0.0, 2.2))],
         (31, 34), (STANDS,), (0.8, 2.6), {1: (0.2, 1.0)}, {1: (0.8, 20)}, (1,)),
    box_with_lid("chest_freezer", "Freezer", "partnet", (0.65, 1.1, 0.85), (75, 150), (25, 80), (8, 80), 0.05, (STANDS,)),
    Made("hole_punch", "HolePunch", "partnet", [Part("heavy base", [block("base", (0.08, 0.12, 0.015), (0, 0, 0.0075)), block("post", (0.03, 0.1, 0.035), (0.015, 0, 0.0325))]),
         Part("hinge lever", [block("lever", (0.1, 0.11, 0.008), (-0.01, 0, 0.06))], "revolute", (0.035, 0, 0.058), (0, -1, 0), (0.0, 0.3))], (8, 20), (STANDS, HELD), (0.1, 0.9), {}, {1: (1, 60)}),
    box_with_lid("treasure_box", "Box", "bare", (0.25, 0.4, 0.22), (12, 80), (0.4, 9), (0.3, 30)),
    Made("hardcover", "Book", "partnet", [Part("free pages", [block("pages", (0.16, 0.24, 0.025), (0, 0, 0.0155))]), Part("hinge cover", [block("cover", (0.16, 0.24, 0.003), (0, 0, 0.0305))], "revolute", (0.08, 0, 0.0295), Y, (0.0, math.pi))],
         (15, 36), (STANDS, HELD), (0.2, 2.5), {}, {1: (0.05, 6)}),
)  # fmt: skip
