"""URDFs as they come from elsewhere: mirrored meshes, primitives, mimics, empty links, odd documents. One a kind."""

import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field

from tests.assets import joint, link, robot, shape

Files = Mapping[str, str | bytes]
WEDGE_M3 = 0.3 * 0.3 / 2.0 * 0.1
"""Volume of ``wedge_obj``, m³; its centre of mass is at a third of either leg: (0.1, 0.05, 0.1) m."""


@dataclass(frozen=True)
class Origin:
    """A URDF and the files beside it."""

    urdf: str | bytes
    files: Files = field(default_factory=dict)


def wedge_obj() -> str:
    """A prism over a right triangle of legs 0.3 m along x and z, 0.1 m along y, wound outwards: it has no mirror
    plane across x, so that a mirror image differs from it."""
    corners = [(x, y, z) for y in (0.0, 0.1) for x, z in ((0.0, 0.0), (0.3, 0.0), (0.0, 0.3))]
    faces = [(1, 2, 3), (4, 6, 5), (1, 4, 5), (1, 5, 2), (2, 5, 6), (2, 6, 3), (3, 6, 4), (3, 4, 1)]
    return "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join(f"f {a} {b} {c}\n" for a, b, c in faces)


def geometry(inside: str, tags: str = "visual collision", xyz: str = "0 0 0", more: str = "") -> str:
    """One geometry as visual, collision or both; ``more`` goes into the visual."""
    return "".join(
        f'<{tag}><origin xyz="{xyz}"/><geometry>{inside}</geometry>{more if tag == "visual" else ""}</{tag}>'
        for tag in tags.split()
    )


def mesh(scale: str, file: str = "wedge.obj", tags: str = "visual collision") -> str:
    return geometry(f'<mesh filename="{file}" scale="{scale}"/>', tags)


def body(size: str = "0.6 0.4 0.3") -> str:
    """A heavy foot that everything else hangs on."""
    return link("body", shape(size))


def mirrored() -> Origin:
    """Two wedges, one the other's mirror image by a negative scale, and one stretched and mirrored."""
    return Origin(
        robot(
            body(),
            link("right", mesh("1 1 1")),
            link("left", mesh("-1 1 1")),
            link("stretched", mesh("-2 -1 0.5")),
            joint("right_joint", "revolute", "body", "right", xyz="0.31 0 0.16", axis="0 0 1", limit="0 1"),
            joint("left_joint", "revolute", "body", "left", xyz="-0.31 0 0.16", axis="0 0 -1", limit="0 1"),
            joint("stretched_joint", "fixed", "body", "stretched", xyz="0.2 -0.02 0.16"),
        ),
        {"wedge.obj": wedge_obj()},
    )


CAPSULE_RADIUS, CAPSULE_LENGTH = 0.03, 0.2


def primitives() -> Origin:
    """A box, a cylinder, a sphere and a capsule, each the whole of a link."""
    capsule = f'<capsule radius="{CAPSULE_RADIUS}" length="{CAPSULE_LENGTH}"/>'
    return Origin(
        robot(
            body(),
            link("disc", geometry('<cylinder radius="0.1" length="0.04"/>')),
            link("ball", geometry('<sphere radius="0.05"/>')),
            link("bar", geometry(capsule)),
            joint("disc_turn", "continuous", "body", "disc", xyz="0 0 0.175", axis="0 0 1"),
            joint("ball_slide", "prismatic", "body", "ball", xyz="0.36 0 0", axis="0 1 0", limit="-0.1 0.1"),
            joint("bar_swing", "revolute", "body", "bar", xyz="-0.34 0 0", axis="1 0 0", limit="-0.5 0.5"),
        )
    )


def png(red: int, green: int, blue: int) -> bytes:
    """A picture of one pixel."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0)
    pixel = zlib.compress(bytes([0, red, green, blue]))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", pixel) + chunk(b"IEND", b"")


def painted() -> Origin:
    """Several visuals and collisions a link, their materials by name, inline and textured; links with looks alone and
    with collision alone."""
    red = '<material name="red"/>'
    blue = '<material name="own"><color rgba="0 0 1 1"/></material>'
    wood = '<material name="wood"/>'
    square = "v 0 0 0\nv 0.2 0 0\nv 0.2 0.2 0\nv 0 0.2 0\nv 0 0 0.02\nv 0.2 0 0.02\nv 0.2 0.2 0.02\nv 0 0.2 0.02\n"
    square += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    square += "".join(f"f {a}/1 {b}/2 {c}/3\nf {a}/1 {c}/3 {d}/4\n" for a, b, c, d in
                      ((1, 4, 3, 2), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)))  # fmt: skip
    door = geometry('<box size="0.02 0.3 0.2"/>', xyz="0 0.15 0", more=red)
    door += geometry('<box size="0.02 0.02 0.06"/>', xyz="0.03 0.28 0", more=blue)
    return Origin(
        robot(
            '<material name="red"><color rgba="1 0 0 1"/></material>',
            '<material name="wood"><texture filename="package://thing/textures/wood.png"/></material>',
            body(),
            link("door", door),
            link("looks", geometry('<box size="0.05 0.05 0.05"/>', "visual", more=red)),
            link("solid", geometry('<box size="0.05 0.05 0.05"/>', "collision")),
            link("top", geometry('<mesh filename="package://thing/meshes/top.obj"/>', more=wood)),
            joint("hinge", "revolute", "body", "door", xyz="0.32 -0.2 0", axis="0 0 1", limit="0 1.2"),
            joint("looks_fixed", "fixed", "body", "looks", xyz="0 0.1 0.175"),
            joint("solid_turn", "revolute", "body", "solid", xyz="0.1 -0.1 0.178", axis="0 0 1", limit="-1 1"),
            joint("top_fixed", "fixed", "body", "top", xyz="-0.29 -0.1 0.151"),
        ),
        {"meshes/top.obj": square, "textures/wood.png": png(150, 100, 50)},
    )


def gears(multiplier: float = -2.0, offset: float = 0.1, more: str = "") -> Origin:
    """A wheel and one that turns ``multiplier`` times as far, from ``offset`` on: balanced bars on upright axles."""
    follow = f'<mimic joint="drive" multiplier="{multiplier}" offset="{offset}"/>'
    return Origin(
        robot(
            body(),
            link("wheel", geometry('<cylinder radius="0.08" length="0.03"/>')),
            link("pinion", geometry('<cylinder radius="0.04" length="0.03"/>')),
            joint("drive", "revolute", "body", "wheel", xyz="-0.1 0 0.17", axis="0 0 1", limit="-0.5 0.5"),
            joint("driven", "revolute", "body", "pinion", xyz="0.1 0 0.17", axis="0 0 1", limit="-2 2", more=follow),
            more,
        )
    )


def gripper() -> Origin:
    """A chain of mimics across kinds: a slider, one that mirrors it, and a hinge that follows the second."""
    return Origin(
        robot(
            body(),
            link("left", shape("0.05 0.02 0.1")),
            link("right", shape("0.05 0.02 0.1")),
            link("dial", geometry('<cylinder radius="0.03" length="0.02"/>')),
            joint("left_slide", "prismatic", "body", "left", xyz="0 0.02 0.202", axis="0 1 0", limit="0 0.1"),
            joint("right_slide", "prismatic", "body", "right", xyz="0 -0.02 0.202", axis="0 1 0", limit="-0.1 0",
                  more='<mimic joint="left_slide" multiplier="-1"/>'),
            joint("dial_turn", "revolute", "body", "dial", xyz="0.2 0 0.162", axis="0 0 1", limit="0 2",
                  more='<mimic joint="right_slide" multiplier="-10" offset="0.2"/>'),
        )
    )  # fmt: skip


def lost_mimics() -> Origin:
    """Mimics of a joint that is not there, of themselves, of each other, and of a fixed joint."""
    names = {"lost": "nowhere", "own": "own", "one": "two", "two": "one", "stuck": "foot"}
    parts = [body("0.8 0.4 0.3"), link("plate", shape("0.2 0.2 0.02"))]
    parts.append(joint("foot", "fixed", "body", "plate", xyz="0 0 -0.161"))
    for index, (name, leader) in enumerate(names.items()):
        parts.append(link(f"{name}_part", shape("0.05 0.05 0.05")))
        more = f'<mimic joint="{leader}"/>'
        at = f"{0.14 * (index - 2)} 0 0.177"
        parts.append(joint(name, "revolute", "body", f"{name}_part", xyz=at, axis="0 0 1", limit="-1 1", more=more))
    return Origin(robot(*parts))


def floats() -> Origin:
    """A box on an empty ``world`` link that it floats on, as Gazebo's models are written."""
    return Origin(
        robot(
            link("world"),
            body(),
            link("door", shape("0.02 0.3 0.2", xyz="0 0.15 0")),
            joint("free", "floating", "world", "body", xyz="0 0 0.5"),
            joint("hinge", "revolute", "body", "door", xyz="0.32 -0.2 0", axis="0 0 1", limit="0 1.2"),
        )
    )


def unsupported(kind: str) -> Origin:
    """A part on a planar joint, or a loose one on a floating joint."""
    return Origin(robot(body(), link("puck", shape("0.1 0.1 0.1")), joint("move", kind, "body", "puck", xyz="0 0 0.3")))


EXTRAS = """<transmission name="hinge_drive"><type>transmission_interface/SimpleTransmission</type>
<joint name="hinge"><hardwareInterface>EffortJointInterface</hardwareInterface></joint>
<actuator name="motor"><mechanicalReduction>1</mechanicalReduction></actuator></transmission>
<gazebo reference="door"><material>Gazebo/Red</material><mu1>0.4</mu1></gazebo>
<gazebo><plugin name="control" filename="libcontrol.so"><ns>/thing</ns></plugin></gazebo>
<ros2_control name="system" type="system"><hardware/></ros2_control>"""


def extras() -> Origin:
    """Transmission, Gazebo and unknown tags."""
    return Origin(
        robot(
            body(),
            link("door", shape("0.02 0.3 0.2", xyz="0 0.15 0") + "<verbose value='yes'/>"),
            joint("hinge", "revolute", "body", "door", xyz="0.32 -0.2 0", axis="0 0 1", limit="0 1.2",
                  more='<safety_controller k_velocity="10" soft_upper_limit="1"/>'),
            EXTRAS,
        )
    )  # fmt: skip


def chain(count: int = 60, every: int = 5) -> Origin:
    """A chain of ``count`` short links, one after the other, on a heavy foot: level, every fifth on an upright hinge,
    the others fixed."""
    parts, before = [body("2 2 0.3")], "body"
    for index in range(count):
        name = f"link_{index}"
        parts.append(link(name, shape("0.02 0.03 0.02", xyz="0.015 0 0")))
        at = "-0.9 0 0.17" if index == 0 else "0.03 0 0"
        kind = {"axis": "0 0 1", "limit": "-0.1 0.1"} if index % every == 0 else {}
        parts.append(joint(f"joint_{index}", "revolute" if kind else "fixed", before, name, xyz=at, **kind))
        before = name
    return Origin(robot(*parts))


def keys(count: int = 66) -> Origin:
    """A board of keys in rows of ten, more than the 64 links that an engine's articulations often bear."""
    parts = [body("1.1 1.1 0.1")]
    for index in range(count):
        at = f"{0.1 * (index % 10) - 0.45} {0.1 * (index // 10) - 0.45} 0.062"
        parts.append(link(f"key_{index}", shape("0.06 0.06 0.02")))
        parts.append(joint(f"press_{index}", "prismatic", "body", f"key_{index}", xyz=at, axis="0 0 1", limit="0 0.01"))
    return Origin(robot(*parts))


def sparse() -> Origin:
    """What URDF allows to be left out: links without geometry between movable joints, inertials absent or zero, limits
    absent, without a range or half stated, axes absent or not of length one."""
    nothing = '<inertial><mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>'
    return Origin(
        robot(
            body(),
            link("cross"),
            link("head", shape("0.1 0.1 0.1", xyz="0 0 0.07") + nothing),
            link("roller", geometry('<cylinder radius="0.05" length="0.05"/>')),
            link("locked", shape("0.05 0.05 0.05")),
            link("tray", shape("0.1 0.1 0.02")),
            joint("pan", "revolute", "body", "cross", xyz="0 0 0.16", axis="0 0 5", limit="-1 1"),
            joint("tilt", "revolute", "cross", "head", axis="0 0.1 0", limit="-0.2 0.2"),
            joint("roll", "revolute", "body", "roller", xyz="0.36 0.1 0"),
            joint("stiff", "revolute", "body", "locked", xyz="-0.33 0 0", axis="0 0 1", limit="0.3 0.3"),
            joint("pull", "prismatic", "body", "tray", xyz="0.36 -0.1 0",
                  more='<limit upper="0.1" effort="5" velocity="1"/>'),
        )
    )  # fmt: skip


NAMES = ("front door", "Tür/links", "ドア.1", "a\"b'c&<d>", "door--open")


def named() -> Origin:
    """Names with spaces, slashes, dots, quotes, two hyphens and beyond ASCII; a link and a joint of one name."""
    parts = [body("1 0.4 0.3")]
    for index, name in enumerate(NAMES):
        text = name.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
        parts.append(link(text, shape("0.1 0.1 0.05")))
        at = f"{0.15 * (index - 2)} 0 0.18"
        parts.append(joint(text, "revolute", "body", text, xyz=at, axis="0 0 1", limit="-0.1 0.1"))
    return Origin(robot(*parts))


def document() -> Origin:
    """A robot without a name, in a namespace, with a byte order mark, CRLF, comments everywhere and commas."""
    door = geometry('<!-- a --><box size="0.02, 0.3, 0.2"/><!-- b -->', xyz="0 0.15 0")
    text = robot(
        "<!-- first -->",
        body(),
        link("door", f"<!-- in a link -->{door}"),
        joint("hinge", "revolute", "body", "door", xyz="0.32 -0.2 0", axis="0 0 1", limit="0 1.2"),
        "<!-- last -->",
    )
    text = text.replace('<robot name="thing">', '<robot xmlns="http://www.ros.org" xmlns:xacro="http://www.ros.org/x">')
    text = text.replace('<?xml version="1.0"?>', '<?xml version="1.0" encoding="utf-8"?>')
    return Origin(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())


ORIGINS = {
    "mirrored": mirrored(), "primitives": primitives(), "painted": painted(), "gears": gears(), "gripper": gripper(),
    "lost_mimics": lost_mimics(), "floats": floats(), "extras": extras(), "chain": chain(), "keys": keys(),
    "sparse": sparse(), "named": named(), "document": document(),
}  # fmt: skip
"""Those that are refined to the end."""


def bar(name: str) -> str:
    """A bar of 1 kg and 0.01 kg·m² that touches nothing."""
    moments = "".join(
        f' {key}="{0.01 if key[1] == key[2] else 0}"' for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    return link(name, f'<inertial><mass value="1"/><inertia{moments}/></inertial>')


def bar_joint(name: str, parent: str, child: str, *, kind: str = "revolute", xyz: str = "0 0 0", more: str = "") -> str:
    """A joint about or along z that nothing stops."""
    return joint(name, kind, parent, child, xyz=xyz, axis="0 0 1",
                 more=f'<limit lower="-10" upper="10" effort="100" velocity="100"/>{more}')  # fmt: skip
