"""Text in other encodings, with other line ends, cut short, packed, or of another kind than its name says."""

import gzip
import io
import zipfile
from collections.abc import Sequence

from tests.hostile.case import HANDLED, READ, REFUSED, Case
from tests.hostile.tiny import BODY, URDF, asset, box, described, hinge, link, robot

PLAIN = robot(link("körper", BODY), link("lid", BODY), hinge(parent="körper"))
LOW, HIGH = (-0.2, -0.2, 0.0), (0.2, 0.2, 0.2)


def _declared(encoding: str) -> str:
    return f"<?xml version='1.0' encoding='{encoding}'?>{PLAIN}"


def _packed() -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("mobility.urdf", PLAIN)
    return content.getvalue()


READABLE: dict[str, str | bytes] = {
    "utf8": PLAIN,
    "utf8_mark": PLAIN.encode("utf-8-sig"),
    "utf16_declared": _declared("utf-16").encode("utf-16"),
    "utf16_mark": PLAIN.encode("utf-16"),
    "latin1_declared": _declared("iso-8859-1").encode("latin-1"),
    "windows_declared": _declared("windows-1252").encode("cp1252"),
    "ascii_references": PLAIN.encode("ascii", "xmlcharrefreplace"),
    "blank_before": f"\n <?xml version='1.0'?>{PLAIN}",
    "comment_before": f"<!-- written by hand -->{PLAIN}",
    "carriage_returns": PLAIN.replace("><", ">\r<"),
    "dos_lines": PLAIN.replace("><", ">\r\n<"),
}
"""URDFs that are read."""
UNREADABLE: dict[str, str | bytes] = {
    "latin1_undeclared": PLAIN.encode("latin-1"),
    "utf8_not": _declared("utf-8").encode("latin-1"),
    "unknown": _declared("klingon").encode(),
    "nul_inside": PLAIN.replace("lid", "l\0id").encode(),
    "two_roots": PLAIN * 2,
    "gzip": gzip.compress(b"\0" + PLAIN.encode()),
    "zip": _packed(),
    "page": "<!DOCTYPE html><html><body>404 not found</body></html>",
    "pointer": "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12\n",
    "json": '{"robot": {}}',
    "mark_alone": b"\xef\xbb\xbf",
    "blanks": " \n\t ",
    "escape": "\x1b[2J" + PLAIN,
    **{f"cut_{share}": PLAIN[: len(PLAIN) * share // 10] for share in range(1, 10)},
}
"""URDFs that are not."""
EITHER: dict[str, str | bytes] = {
    "gzip_whole": gzip.compress(PLAIN.encode()),
    "utf32": _declared("utf-32").encode("utf-32"),
    "utf7": _declared("utf-7").encode("utf-7"),
    "ebcdic": _declared("cp037").encode("cp037"),
    "shift_jis": "<?xml version='1.0' encoding='shift_jis'?>" + robot(),
}
"""URDFs of which a parser may know the encoding."""


def cases() -> Sequence[Case]:
    """A URDF, a mesh and the files beside them in each encoding."""
    found = [Case(f"urdf_{name}", described(text), READ) for name, text in READABLE.items()]
    found += [Case(f"urdf_{name}", described(text), REFUSED) for name, text in UNREADABLE.items()]
    found += [Case(f"urdf_{name}", described(text), HANDLED) for name, text in EITHER.items()]
    plain = box(LOW, HIGH)
    meshes: dict[str, str | bytes] = {
        "mark": plain.encode("utf-8-sig"),
        "utf16": plain.encode("utf-16"),
        "latin1": f"# kö\n{plain}".encode("latin-1"),
        "carriage_returns": plain.replace("\n", "\r"),
        "dos_lines": plain.replace("\n", "\r\n"),
        "nul": plain.replace("f 1", "f\0 1", 1),
        "commas": plain.replace("0.2", "0,2"),
        "long_line": f"# {'x' * 1_000_000}\n{plain}",
        "continued": plain.replace("f 1 2 4 3", "f 1 2 \\\n4 3"),
        "cut": plain[: len(plain) // 2],
        "stl_bytes": b"solid " + bytes(100),
        "page": "<html>404</html>",
        "pointer": "version https://git-lfs.github.com/spec/v1\n",
        "gzip": gzip.compress(plain.encode()),
    }
    found += [Case(f"mesh_{name}", asset({BODY: text}), HANDLED) for name, text in meshes.items()]
    beside: dict[str, tuple[str, str | bytes]] = {
        "meta_utf16": ("meta.json", '{"model_cat": "Bóx"}'.encode("utf-16")),
        "meta_mark": ("meta.json", '{"model_cat": "Box"}'.encode("utf-8-sig")),
        "meta_deep": ("meta.json", "[" * 100_000),
        "meta_nan": ("meta.json", '{"model_cat": NaN}'),
        "meta_surrogate": ("meta.json", '{"model_cat": "\\udcff"}'),
        "meta_control": ("meta.json", '{"model_cat": "\\u001b[31mred\\u0000"}'),
        "meta_long": ("meta.json", '{"model_cat": "' + "x" * 1_000_000 + '"}'),
        "meta_list": ("meta.json", "[1, 2]"),
        "meta_number": ("meta.json", '{"model_cat": 12}'),
        "semantics_utf16": ("semantics.txt", "body static bódy\n".encode("utf-16")),
        "semantics_latin1": ("semantics.txt", "body static bódy\n".encode("latin-1")),
        "semantics_control": ("semantics.txt", "body static \x1b[31mred\0\n"),
        "semantics_long": ("semantics.txt", "body static " + "x" * 1_000_000),
        "look_latin1": ("textured_objs/look.mtl", "newmtl röd\nmap_Kd röd.png\n".encode("latin-1")),
        "look_utf16": ("textured_objs/look.mtl", "newmtl red\n".encode("utf-16")),
    }
    found += [Case(name, asset({file: text}), HANDLED) for name, (file, text) in beside.items()]
    found.append(Case("urdf_capitals", asset({URDF: None, "MOBILITY.URDF": robot()}), REFUSED, "small letters"))
    return found
