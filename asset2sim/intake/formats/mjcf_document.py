"""An MJCF file as a document, mended so far that MuJoCo compiles it: includes, foreign elements, repeated names."""

import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.document import parse_xml, unreadable
from asset2sim.storage.regular_files import is_file

FOLDER_OF = {"mesh": "meshdir", "texture": "texturedir", "hfield": "meshdir", "skin": "meshdir"}
"""Asset → the compiler's attribute that names the folder of its files."""
NAMED = ("body", "joint", "geom", "site", "camera", "light", "mesh", "texture", "material", "hfield")
"""Elements whose names MuJoCo wants unique, each kind by itself."""
USERS = {"mesh": ("geom", "mesh"), "texture": ("material", "texture"), "hfield": ("geom", "hfield")}
"""Asset whose file may be missing → the element and the attribute that refer to it."""
MAX_INCLUDES = 200
UNLISTED = ("frame", "replicate")
"""Elements that MuJoCo reads and that its printed schema leaves out."""


def mended_document(file: Path) -> tuple[bytes, tuple[str, ...]]:
    """The file's text with its includes in place and absolute folders, without what MuJoCo refuses to read, and a note
    for each thing that was changed. Raises AssetError (unreadable_asset) where it or an included file is no XML."""
    root = inlined(file)
    absolute_folders(root, file.parent)
    notes = (*without_unknown(root), *without_repeated_names(root), *without_missing_files(root))
    return etree.tostring(root), tuple(dict.fromkeys(notes))


def inlined(file: Path) -> Element:
    """The root with the content of every included file in its place; paths are relative to the outermost file."""
    root, included = parse_xml(file, "MJCF")[0], 0
    while (include := next(root.iter("include"), None)) is not None:
        included += 1
        name = str(include.get("file"))
        if included > MAX_INCLUDES:
            raise unreadable(
                file, "mjcf_refused", f"more than {MAX_INCLUDES} includes, '{name}' among them; break the circle"
            )
        place, parent = file.parent / name, include.getparent()
        assert parent is not None
        if not is_file(place):
            raise unreadable(file, "mjcf_refused", f"its include '{name}' is not there: restore the file")
        at = parent.index(include)
        parent[at : at + 1] = list(parse_xml(place, "MJCF")[0])
    return root


def absolute_folders(root: Element, base: Path) -> None:
    """Replace the compiler's folders by absolute ones, so that the text is read alike from anywhere."""
    stated = {key: value for compiler in root.iter("compiler") for key, value in compiler.attrib.items()}
    shared = str(stated.get("assetdir", ""))
    folders = {key: str(base.resolve() / str(stated.get(key, shared))) for key in ("meshdir", "texturedir")}
    for compiler in root.iter("compiler"):
        for key in ("assetdir", *folders):
            compiler.attrib.pop(key, "")
    etree.SubElement(root, "compiler", folders)


def without_unknown(root: Element) -> Iterator[str]:
    """Remove elements and attributes that MuJoCo's schema does not have; a note for each kind."""
    known = schema()
    for element in list(root.iter(etree.Element)):
        tag = str(element.tag)
        if tag in UNLISTED:
            continue
        if tag not in known:
            parent = element.getparent()
            if parent is not None:
                parent.remove(element)
            yield f"<{tag}>, which MuJoCo does not know, is left out"
            continue
        for key in [str(key) for key in element.attrib if str(key) not in known[tag]]:
            del element.attrib[key]
            yield f"'{key}' of <{tag}>, which MuJoCo does not know, is left out"


@cache
def schema() -> Mapping[str, frozenset[str]]:
    """Element → the attributes that MuJoCo's parser takes, by the schema that it prints."""
    import mujoco

    found: dict[str, set[str]] = {}
    words: set[str] = set()
    for line in mujoco.mj_printSchema(False, False).splitlines():
        head = re.match(r"\s*(?:\((\w+)\))?(\w+) +\([^)]\)", line)
        if head is not None:
            prefix, tag = head.groups()
            words = found.setdefault(tag, set())
            if prefix:  # "(world)body" stands for both
                found[prefix + tag] = words
        words.update(line[head.end() if head else 0 :].split())
    return {tag: frozenset(names) for tag, names in found.items()}


def without_repeated_names(root: Element) -> Iterator[str]:
    """Drop an asset whose name another has already, and the name of another element; the first keeps it."""
    taken: set[tuple[str, str]] = set()
    for element in list(root.iter(*NAMED)):
        tag, name = str(element.tag), element.get("name")
        parent = element.getparent()
        if name is None or parent is None or any(str(above.tag) == "default" for above in element.iterancestors()):
            continue
        if (tag, name) not in taken:
            taken.add((tag, name))
        elif parent.tag == "asset":
            parent.remove(element)
            yield f"a second {tag} '{name}' is left out"
        else:
            del element.attrib["name"]
            yield f"a second {tag} '{name}' has no name"


def without_missing_files(root: Element) -> Iterator[str]:
    """Drop assets whose file is not there, and what refers to them: a material loses its texture, a mesh its geoms."""
    folders = {key: str(value) for compiler in root.iter("compiler") for key, value in compiler.attrib.items()}
    for asset, (user, attribute) in USERS.items():
        for element in list(root.iter(asset)):
            file, parent = element.get("file"), element.getparent()
            if file is None or parent is None or parent.tag != "asset":
                continue
            if is_file(Path(folders.get(FOLDER_OF[asset], "")) / file):
                continue
            name = element.get("name") or Path(file).stem
            parent.remove(element)
            yield f"{asset} '{name}' is left out: its file '{file}' is not there"
            for item in [item for item in root.iter(user) if item.get(attribute) == name]:
                above = item.getparent()
                if user == "material":
                    del item.attrib[attribute]
                elif above is not None:
                    above.remove(item)
