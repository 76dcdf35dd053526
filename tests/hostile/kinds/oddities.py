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


POINTER = "version https://git-lfs.github.com/spec/v1\n"
WORDS = '<inertial><mass value="heavy"/><inertia ixx="x" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
LAUGHS = "<!DOCTYPE r [" + "".join(f'<!ENTITY e{n + 1} "{f"&e{n};" * 10}">' for n in range(9)) + "]>"
GROUPS = "".join(
    f"o g{n}\nv {n % 20}e-2 0 0\nv {n % 20}e-2 .1 0\nv 0 0 .1\nf {3 * n + 1} {3 * n + 2} {3 * n + 3}\n"
    for n in range(1500)
)
PLY = b"ply\nformat binary_little_endian 1.0\nelement vertex 999999999999\nproperty float x\nend_header\n"
GLTF = (
    '{"asset":{"version":"2.0"},"buffers":[{"uri":"../../../../etc/passwd","byteLength":9}],"bufferViews":[{"buffer":0,'
    '"byteLength":9}],"accessors":[{"bufferView":0,"componentType":5126,"count":1,"type":"VEC3"}],"meshes":[{"primitives":'
    '[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0}'
)
NO_MESH = frozenset({FailureMode.MISSING_MESH})
JOINT = frozenset({FailureMode.INVALID_JOINT_CONFIGURATION})
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
    "limits_infinite": (_hinged('<limit lower="-inf" upper="inf" effort="inf" velocity="nan"/>'), "limits_unlimited"),
    "laughs_unused": ({URDF: LAUGHS + robot(BODY_LINK, LID_LINK, hinge()).split("?>")[-1]}, ""),
    "utf_16": ({URDF: robot(BODY_LINK, LID_LINK, hinge()).split("?>")[-1].encode("utf-16")}, ""),
    "library_outside": ({BODY: f"mtllib ../../../../etc/passwd\n{CUBE}"}, ""),
    "face_of_nothing": ({BODY: f"{CUBE}f 0 0 0\n"}, ""),
    "mass_in_words": ({URDF: robot(BODY_LINK, link("lid", LID, WORDS), hinge())}, ""),
    "groups_many": ({BODY: GROUPS}, ""),
    "meta_list": ({"meta.json": "[1,2,3]"}, ""),
    "meta_deep": ({"meta.json": "[" * 100_000}, ""),
}
"""Files that are read → with which finding, if any."""
REFUSED: dict[str, tuple[Files, frozenset[FailureMode], str]] = {
    "origin_far": (_hinged(joint=("0 0 0.22", "0 0 1e6")), UNREADABLE, "mend the origins"),
    "meshes_tiny": (_body(f'{BODY}" scale="1e-6 1e-6 1e-6', {LID: None}), HANDLED, ""),
    "all_tiny": (TINY, UNREADABLE, "state metres"),
    "urdf_pointer": ({URDF: f"{POINTER}oid sha256:0\nsize 9\n"}, UNREADABLE, "Git LFS pointer, not the URDF"),
    "urdf_page": ({URDF: "<!doctype html><html><body>404</body></html>"}, UNREADABLE, "web page"),
    "urdf_gzip": ({URDF: b"\x1f\x8b" + bytes(20)}, UNREADABLE, "gzip archive"),
    "urdf_zeros": ({URDF: bytes(1000)}, UNREADABLE, "not readable as XML"),
    "joint_of_itself": (_hinged(joint=('parent link="body"', 'parent link="lid"')), JOINT, "are both 'lid'"),
    "comma_for_point": (_hinged(joint=('xyz="0 0 0.22"', 'xyz="0 0 0,22"')), JOINT, "with a point and no comma"),
    "origin_of_two": (_hinged(joint=('xyz="0 0 0.22"', 'xyz="0 0.22"')), JOINT, "holds 2 numbers"),
    "type_misspelt": (_hinged(joint=('"revolute"', '"revolut"')), JOINT, "use one of"),
    "mesh_pointer": ({BODY: f"{POINTER}oid sha256:0\n"}, NO_MESH, "git lfs pull"),
    "mesh_points": ({BODY: "v 0 0 0\nv 1 0 0\n"}, NO_MESH, "no triangle"),
    "mesh_infinite": ({BODY: CUBE.replace("v ", "v 1e400 ", 1)}, NO_MESH, "not finite"),
    "mesh_cut_off": ({BODY: f"{CUBE}f 1 2 99\n"}, NO_MESH, "does not hold"),
    "mesh_url": (_body("http://127.0.0.1:9/a.obj"), NO_MESH, "web address"),
    "mesh_of_others": (_body("a.fbx", {"a.fbx": b"Kaydara FBX Binary"}), NO_MESH, "no format that is read"),
    "stl_boast": (_body("a.stl", {"a.stl": bytes(80) + struct.pack("<I", 4_000_000_000)}), NO_MESH, "cut off"),
    "ply_boast": (_body("a.ply", {"a.ply": PLY}), NO_MESH, "cannot be read"),
    "glb_boast": (_body("a.glb", {"a.glb": b"glTF\x02\0\0\0\xff\xff\xff\x7f"}), NO_MESH, "ends before"),
    "dae_hollow": (_body("a.dae", {"a.dae": "<COLLADA><library_geometries/></COLLADA>"}), NO_MESH, "cannot be read"),
    "gltf_outside": (_body("a.gltf", {"a.gltf": GLTF}), NO_MESH, "lies outside"),
    "scale_of_nothing": (_body(f'{BODY}" scale="0 1 1'), NO_MESH, "none of them 0"),
    "scale_in_words": (_body(f'{BODY}" scale="large'), NO_MESH, "state one number or three"),
    "stl_degenerate": (_stl(b"", bytes(50)), frozenset({FailureMode.MISSING_MESH}), "has no area"),
}
"""Files that are not, with why."""


def cases() -> Sequence[Case]:
    """The cases."""
    read = [Case(name, asset(files), READ, finds=code) for name, (files, code) in READABLE.items()]
    return [*read, *(Case(name, asset(files), modes, says) for name, (files, modes, says) in REFUSED.items())]
