"""A tiny good asset, a box with a lid on a hinge, and ways to spoil it."""

from collections.abc import Callable, Mapping
from pathlib import Path

from tests.hostile.case import CANARY, Place

Write = Callable[[Place], None]
URDF = "mobility.urdf"
MESHES = "textured_objs"
BODY, LID = f"{MESHES}/body.obj", f"{MESHES}/lid.obj"
PICTURE = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010802000000907753de0000000c4944415408d763f8cfc0000003010100c9fe92ef"
    "0000000049454e44ae426082"
)
"""A PNG of one pixel."""


def box(low: tuple[float, float, float], high: tuple[float, float, float], head: str = "mtllib look.mtl\n") -> str:
    """A closed box as OBJ."""
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    vertices = "".join("v {} {} {}\n".format(*corner) for corner in corners)
    quads = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
    return f"{head}{vertices}usemtl red\n" + "".join(f"f {quad}\n" for quad in quads)


def link(name: str, mesh: str = "", inner: str = "") -> str:
    """A link with one mesh to see and to touch."""
    shape = f'<geometry><mesh filename="{mesh}"/></geometry>'
    return f'<link name="{name}">{inner}<visual>{shape}</visual><collision>{shape}</collision></link>'


def hinge(
    name: str = "joint_0", parent: str = "body", child: str = "lid", inner: str = "", kind: str = "revolute"
) -> str:
    """A joint about x at the box's back edge."""
    limit = '<limit lower="0" upper="1.5" effort="10" velocity="1"/>'
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="0 0 0.22"/><axis xyz="1 0 0"/>{ends}{inner or limit}</joint>'
    )


def robot(*parts: str, head: str = "", attributes: str = 'name="box"') -> str:
    """A URDF of these parts; by default of the whole box."""
    parts = parts or (link("body", BODY), link("lid", LID), hinge())
    return f"{head}<robot {attributes}>{''.join(parts)}</robot>"


def good_files() -> dict[str, bytes | str]:
    """Path → content of a good asset."""
    return {
        URDF: robot(),
        BODY: box((-0.2, -0.2, 0.0), (0.2, 0.2, 0.2)),
        LID: box((-0.2, -0.2, 0.0), (0.2, 0.2, 0.02)),
        f"{MESHES}/look.mtl": "newmtl red\nKd 1 0 0\nmap_Kd red.png\n",
        f"{MESHES}/red.png": PICTURE,
        "semantics.txt": "body static box_body\nlid hinge rotation_lid\n",
        "meta.json": '{"model_cat": "Box"}',
    }


def write_files(folder: Path, files: Mapping[str, bytes | str | None]) -> None:
    """Write files below a folder; those that are None are left out."""
    for name, content in files.items():
        if content is None:
            continue
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)


def asset(changes: Mapping[str, bytes | str | None] | None = None, then: Write | None = None) -> Write:
    """A function that writes the good asset with these files in the place of its own; ``then`` does more to it."""

    def write(place: Place) -> None:
        write_files(place.asset, {**good_files(), **(changes or {})})
        if then is not None:
            then(place)

    return write


def described(text: str | bytes, more: Mapping[str, bytes | str | None] | None = None) -> Write:
    """A function that writes the good asset with another URDF."""
    return asset({**(more or {}), URDF: text})


def write_outside(folder: Path) -> None:
    """Write the files that lie outside a dataset and are no business of its."""
    head = f"# {CANARY}\nmtllib look.mtl\n"
    files: dict[str, bytes | str] = {
        "secret.txt": f"{CANARY}\n",
        "secret.yaml": f"word: {CANARY}\n",
        "secret.xml": f"<robot name='{CANARY}'><link name='{CANARY}'/></robot>",
        "mesh.obj": box((-0.2, -0.2, 0.0), (0.2, 0.2, 0.2), head),
        "look.mtl": f"# {CANARY}\nnewmtl red\nKd 1 0 0\nmap_Kd red.png\n",
        "red.png": PICTURE + CANARY.encode(),
        "meta.json": f'{{"model_cat": "{CANARY}"}}',
        "semantics.txt": f"body static {CANARY}\nlid hinge {CANARY}\n",
        **{f"asset/{name}": content for name, content in good_files().items()},
        "asset/meta.json": f'{{"model_cat": "{CANARY}"}}',
        f"asset/{BODY}": box((-0.2, -0.2, 0.0), (0.2, 0.2, 0.2), head),
    }
    write_files(folder, files)
