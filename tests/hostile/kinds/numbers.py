"""Numbers that no program writes on purpose: in URDFs, in a user's own numbers, and in what prompts ask."""

from collections.abc import Sequence

from schemas.vocabulary import FailureMode
from tests.hostile.case import HANDLED, RULES, Case, Place
from tests.hostile.tiny import BODY, LID, Write, asset, box, described, hinge, link, robot, write_files

VALUES = {
    "nan": "nan", "inf": "-inf", "huge": "1e308", "over": "1e999", "tiny": "1e-320", "zero": "0", "minus": "-1",
    "empty": "", "word": "abc", "comma": "1,5", "hex": "0x10", "digits": "9" * 400, "arabic": "١٢", "two": "1 2",
}  # fmt: skip
"""What stands where one number should."""
FILE = "overrides.csv"
BOX = '<geometry><box size="0.1 0.1 {}"/></geometry>'
MASS = '<inertial><mass value="{}"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
INERTIA = '<inertial><mass value="1"/><inertia ixx="{}" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
LIMIT = '<limit lower="0" upper="1.5" effort="10" velocity="1"/>'
SLOTS = {
    "mass": robot(link("body", BODY), link("lid", LID, MASS), hinge()),
    "inertia": robot(link("body", BODY), link("lid", LID, INERTIA), hinge()),
    "origin": robot(link("body", BODY), link("lid", LID), hinge().replace('xyz="0 0 0.22"', 'xyz="0 0 {}"')),
    "axis": robot(link("body", BODY), link("lid", LID), hinge().replace('xyz="1 0 0"', 'xyz="1 0 {}"')),
    "lower": robot(link("body", BODY), link("lid", LID), hinge(inner=LIMIT.replace('"0"', '"{}"'))),
    "upper": robot(link("body", BODY), link("lid", LID), hinge(inner=LIMIT.replace('"1.5"', '"{}"'))),
    "effort": robot(link("body", BODY), link("lid", LID), hinge(inner=LIMIT.replace('"10"', '"{}"'))),
    "damping": robot(link("body", BODY), link("lid", LID), hinge(inner=f'{LIMIT}<dynamics damping="{{}}"/>')),
    "scale": robot(link("body", BODY), link("lid", f'{LID}" scale="1 1 {{}}'), hinge()),
    "box": robot(link("body", BODY).replace("</link>", f"<collision>{BOX}</collision></link>"), link("lid", LID),
                 hinge()),
}  # fmt: skip
"""A URDF by what its one number, ``{}``, is."""

OWN = {
    "scale": ("-1", "0", "nan", "inf", "1e999", "1e-400", "big", "1,5", "50%", "2x", "0x10", "1 2"),
    "size_m": ("-0.3", "0", "nan", "35cm", "0.3 m", "ten"),
    "mass_kg": ("-3", "0", "inf", "3kg", "5-6"),
    "joint:joint_0": ("nan", "inf", "1e999", "120%", "-5%", "ajar", "30 degrees", "1.5.2", "half", "2 m/s"),
    "material:lid": ("unobtainium", "7850", "-", "steel;wood"),
}
"""Cells of ``overrides.csv`` that cannot be, by column."""
MEANT = {
    "scale": ("1e-9", "1e9", "1e300"),
    "size_m": ("1e-6", "1e6"),
    "mass_kg": ("1e-12", "1e12"),
    "joint:joint_0": ("1e300", "-720deg", "5m", "100%"),
    "joint:gone": ("0.5",),
    "material:gone": ("steel",),
}
"""Cells that could be, and cannot for this asset: it has a row, whatever becomes of it."""
PROMPTS = (
    "A box 5 km long.", "A box of -3 kg.", "Scale to 1e9.", "A box 0 cm wide.", "A box of 1e400 kg.", "scale = nan",
    "A box of 10^30 m.", "A box 1/0 m long.", "The lid opened by -400 degrees.", "The lid 900 % open.",
    "The lid opened by 1e99 rad.", "A box of ½ m and ١٢ kg.", "A box 1.2.3.4 m long.", f"A box {'9' * 400} m long.",
    "Damping 1e308 N·m·s/rad, friction -5 N·m.", "Friction nan, stiffness inf.",
)  # fmt: skip


def _limited(lower: float, upper: float, kind: str = "revolute", more: str = "") -> str:
    limit = f'{more}<limit lower="{lower}" upper="{upper}" effort="10" velocity="1"/>'
    return robot(link("body", BODY), link("lid", LID), hinge(inner=limit, kind=kind))


TOLD = {
    "told_mass_minus": (SLOTS["mass"].replace("{}", "-3"), "inertial_unusable"),
    "told_mass_huge": (SLOTS["mass"].replace("{}", "1e30"), "inertial_unusable"),
    "told_limits_huge": (_limited(-1000, 1000), "limits_unlimited"),
    "told_limits_degrees": (_limited(0, 90), "limits_in_degrees"),
    "told_slide_km": (_limited(0, 1000, "prismatic"), "range_implausible"),
    "told_continuous": (_limited(0, 1.5, "continuous"), "limits_ignored"),
    "told_mimic_itself": (_limited(0, 1.5, more='<mimic joint="joint_0"/>'), "mimic_unusable"),
}
"""URDFs that are read, with a finding that says what was not believed."""


def cases() -> Sequence[Case]:
    """Each number in each place."""
    urdfs = [
        Case(f"{slot}_{name}", described(text.replace("{}", value)), HANDLED)
        for slot, text in SLOTS.items()
        for name, value in VALUES.items()
    ]
    refused = [
        Case(f"own_{number:02}", _own(column, cell), says=f"line 2, column '{column}'")
        for number, (column, cell) in enumerate((column, cell) for column, cells in OWN.items() for cell in cells)
    ]
    meant = [
        Case(f"meant_{number:02}", asset(), HANDLED, row=f'meant_{number:02},meant_{number:02},Box,"{prompt}"',
             words=RULES)
        for number, prompt in enumerate(PROMPTS)
    ]  # fmt: skip
    stated = [
        Case(f"stated_{number:02}", asset(then=_stated(column, cell)), HANDLED, words=RULES)
        for number, (column, cell) in enumerate((column, cell) for column, cells in MEANT.items() for cell in cells)
    ]
    told = [Case(name, described(text), HANDLED, finds=code) for name, (text, code) in TOLD.items()]
    far = {BODY: box((-0.2, -0.2, 0.0), (0.2, 0.2, 0.2)) + "v 1e4 0 0\nv 1e4 0.1 0\nv 1e4 0 0.1\nf 9 10 11\n"}
    told.append(Case("told_stray", asset(far), frozenset({FailureMode.NONE}), finds="stray_triangles", words=RULES))
    return [*urdfs, *refused, *meant, *stated, *told]


def _own(column: str, cell: str) -> Write:
    """The good asset alone, with one number of the user's own."""
    return asset(then=lambda place: write_files(place.data, {FILE: f'asset_id,{column}\nasset,"{cell}"\n'}))


def _stated(column: str, cell: str) -> Write:
    """One row more in a table of the user's own numbers that all cases share."""

    def write(place: Place) -> None:
        table = place.data / FILE
        with table.open("a", encoding="utf-8") as stream:
            if not stream.tell():
                stream.write(f"asset_id,{','.join(MEANT)}\n")
            cells = (cell if name == column else "" for name in MEANT)
            stream.write(f"{place.asset.name},{','.join(cells)}\n")

    return write
