"""Names of folders, meshes, links and joints that shells, file systems, XML, URLs and tables read otherwise."""

import os
from collections.abc import Sequence
from xml.sax.saxutils import quoteattr

from asset2sim.intake.asset_folders import id_problem, safe_id
from tests.hostile.case import HANDLED, UNREADABLE, Case
from tests.hostile.tiny import BODY, LID, MESHES, Write, asset, box, described, hinge, robot

FOLDERS = (
    *(
        "in side", " before", "after ", "comma,", "a,b", "new\nline", "tab\there", "carriage\rreturn",
        "\x1b[31mred\x1b[0m",
    ),
    *("del\x7f", 'double"quote', "single'quote", "back\\slash", "per%41cent", "%2e%2e", "%", "hash#tag", "query?x=1"),
    *("star*", "co:lon", "pi|pe", "le<ss", "grea>ter", "semi;colon", "$HOME", "`id`", "$(id)", "null", "NULL"),
    *(
        "CON", "-rf", "--help", "~", "é", "e\u0301", "\u202egnp", "\U0001f600", "zero\u200bwidth", "\ufeffbom",
        "\u2028line",
    ),
    *(
        os.fsdecode(b"latin\xe9"), os.fsdecode(b"\xff\xfe"), "x" * 255, "y" * 200, "z" * 201, "ü" * 100, "ü" * 101,
        "assets",
    ),
    *(
        "a.urdf", "0", "1e5", "nan", "true", "{x}", "[x]", "(x)", "!x", "&amp;", "=1+1", "+1", "@x", "index.json",
        "Load.py", "[red]boxy", "Cased", "cased", "^x", "a" * 64 + ".b",
    ),
)  # fmt: skip
"""Names of asset folders."""
PARTS = (
    *(
        "in side",
        'quo"te',
        "a'b",
        "am&p",
        "le<ss",
        "per%20cent",
        "%41",
        "hash#x",
        "query?x",
        "co:lon",
        "semi;x",
        "$HOME",
    ),
    *("é", "\U0001f600", "\u202egnp", "comma,", "back`tick`", "{x}", "[0]", "-x", "..", "world", "base", "x" * 240),
)
"""Names of meshes, links and joints."""


def cases() -> Sequence[Case]:
    """Each name as an asset's folder, a mesh's file, a link and a joint."""
    found = []
    for name in FOLDERS:
        row = safe_id(name) if id_problem(name) else name
        modes = UNREADABLE if id_problem(name) else HANDLED
        found.append(Case(name, asset(), modes, "rename the folder" if id_problem(name) else "", row))
    for number, name in enumerate(PARTS):
        if name != "..":
            found.append(Case(f"mesh_{number:02}", _mesh(name), HANDLED))
        found.append(Case(f"link_{number:02}", _link(name), HANDLED))
        found.append(Case(f"joint_{number:02}", _joint(name), HANDLED))
    return found


def _shaped(name: str, file: str) -> str:
    shape = f"<geometry><mesh filename={quoteattr(file)}/></geometry>"
    return f"<link name={quoteattr(name)}><visual>{shape}</visual><collision>{shape}</collision></link>"


def _mesh(name: str) -> Write:
    file = f"{MESHES}/{name}.obj"
    urdf = robot(_shaped("body", file), _shaped("lid", LID), hinge())
    return described(urdf, {BODY: None, file: box((-0.2, -0.2, 0.0), (0.2, 0.2, 0.2))})


def _link(name: str) -> Write:
    joint = hinge().replace('parent link="body"', f"parent link={quoteattr(name)}")
    return described(robot(_shaped(name, BODY), _shaped("lid", LID), joint))


def _joint(name: str) -> Write:
    joint = hinge().replace('joint name="joint_0"', f"joint name={quoteattr(name)}")
    return described(robot(_shaped("body", BODY), _shaped("lid", LID), joint))
