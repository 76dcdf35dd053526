"""What tools and people leave by mistake, harmless to a parser: it is read, or refused for what it is."""

import struct
from collections.abc import Mapping, Sequence

from schemas.vocabulary import FailureMode
from tests.hostile.case import HANDLED, READ, UNREADABLE, Case
from tests.hostile.tiny import BODY, LID, MESHES, URDF, asset, good_files, hinge, link, robot

Files = Mapping[str, bytes | str | None]
BODY_LINK, LID_LINK, CUBE = link("body", BODY), link("lid", LID), str(good_files()[BODY])
FLAT = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
PNG_HEAD = b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + b"IHDR" + struct.pack(">IIBBBBB", 60000, 60000, 8, 6, 0, 0, 0)


def _hinged(inner: str = "", more: str = "", joint: tuple[str, str] = ("", "")) -> Files:
    return {URDF: robot(BODY_LINK, LID_LINK, hinge(inner=inner).replace(*joint), more)}


def _limit(lower: float = 0, upper: float = 1, effort: float = 10, before: str = "", after: str = "") -> str:
    return f'{before}<limit lower="{lower}" upper="{upper}" effort="{effort}" velocity="1"/>{after}'


def _third(factor: float) -> str:
    mimic = f'<mimic joint="joint_0" multiplier="{factor}"/>'
    return link("third", LID) + hinge("j2", "lid", "third", inner=_limit(before=mimic))


def _inertial(com: str = "0 0 0", mass: float = 1, ixy: float = 0) -> Files:
    tensor = f'<inertia ixx=".1" ixy="{ixy}" ixz="0" iyy=".1" iyz="0" izz=".1"/>'
    stated = f'<inertial><origin xyz="{com}"/><mass value="{mass}"/>{tensor}</inertial>'
    return {URDF: robot(BODY_LINK, link("lid", LID, stated), hinge())}


def _body(mesh: str, more: Files | None = None) -> Files:
    return {URDF: robot(link("body", mesh), LID_LINK, hinge()), **(more or {})}


def _stl(head: bytes, *triangles: bytes) -> Files:
    return _body("a.stl", {"a.stl": head.ljust(80) + struct.pack("<I", len(triangles)) + b"".join(triangles)})


TINY = {URDF: robot(*(link(*pair) for pair in (("body", f'{BODY}" scale="1e-8 1e-8 1e-8'),
                                               ("lid", f'{LID}" scale="1e-8 1e-8 1e-8'))),
                    hinge().replace("0 0 0.22", "0 0 2e-9"))}  # fmt: skip
READABLE: dict[str, tuple[Files, str]] = {
    "mimic_circle": (_hinged(_limit(before='<mimic joint="j2"/>'), _third(1)), "mimic_unusable"),
    "mimic_huge": (_hinged(more=_third(1e6)), "mimic_limits"),
    "limits_hair": (_hinged(_limit(upper=1e-7)), ""),
    "effort_minus": (_hinged(_limit(effort=-5)), "effort_zero"),
    "axis_long": (_hinged(joint=('xyz="1 0 0"/>', 'xyz="1e5 1e5 0"/>')), "axis_not_unit"),
    "origin_turns": (_hinged(joint=('xyz="0 0 0.22"', 'xyz="0 0 0.22" rpy="1e6 0 0"')), ""),
    "friction_huge": (_hinged(_limit(after='<dynamics damping="1e12" friction="1e12"/>')), "friction_sticks"),
    "safety_crossed": (_hinged(_limit(after='<safety_controller soft_lower_limit="5" soft_upper_limit="-5"/>')), ""),
    "comment_long": (_hinged(more=f"<!--{'-x' * 500_000}-->"), ""),
    "root_is_child": ({URDF: robot(BODY_LINK, LID_LINK, hinge(parent="lid", child="body"))}, ""),
    "same_place": ({URDF: robot(BODY_LINK, link("lid", BODY), hinge())}, ""),
    "com_far": (_inertial("500 0 0"), "com_outside"),
    "inertia_crossed": (_inertial(ixy=5), "inertia_singular"),
    "mass_heavy": (_inertial(mass=1e5), "mass_unbelievable"),
    "mirrored": (_body(f'{BODY}" scale="-1 1 1'), ""),
    "obj_counts_back": ({BODY: CUBE.replace("f 1 2 4 3", "f -8 -7 -5 -6")}, ""),
    "obj_nan_unused": ({BODY: f"{CUBE}v nan nan nan\n"}, ""),
    "obj_far_unused": ({BODY: f"{CUBE}v 1e6 0 0\n"}, ""),
    "obj_line_goes_on": ({BODY: CUBE.replace("f 1 2 4 3", "f 1 2 \\\n4 3")}, ""),
    "obj_long_line": ({BODY: f"# {'x' * 3_000_000}\n{CUBE}"}, ""),
    "stl_solid_binary": (_stl(b"solid COLOR=\xff\0\0\xff", FLAT), ""),
    "png_bomb": ({f"{MESHES}/red.png": PNG_HEAD + b"\0" * 4}, ""),
    "library_of_itself": ({f"{MESHES}/look.mtl": "newmtl red\nmap_Kd look.mtl\nmtllib look.mtl\n"}, ""),
    "semantics_ragged": ({"semantics.txt": "body\nlid hinge\nx y z w v\n\0\n"}, ""),
    "meta_list": ({"meta.json": "[1,2,3]"}, ""),
    "meta_deep": ({"meta.json": "[" * 100_000}, ""),
}
"""Files that are read → with which finding, if any."""
REFUSED: dict[str, tuple[Files, frozenset[FailureMode], str]] = {
    "origin_far": (_hinged(joint=("0 0 0.22", "0 0 1e6")), UNREADABLE, "mend the origins"),
    "meshes_tiny": (_body(f'{BODY}" scale="1e-6 1e-6 1e-6', {LID: None}), HANDLED, ""),
    "all_tiny": (TINY, UNREADABLE, "state metres"),
    "stl_degenerate": (_stl(b"", bytes(50)), frozenset({FailureMode.MISSING_MESH}), "has no area"),
}
"""Files that are not, with why."""


def cases() -> Sequence[Case]:
    """The cases."""
    read = [Case(name, asset(files), READ, finds=code) for name, (files, code) in READABLE.items()]
    return [*read, *(Case(name, asset(files), modes, says) for name, (files, modes, says) in REFUSED.items())]
