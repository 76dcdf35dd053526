"""An MJCF file as a document, mended so far that MuJoCo compiles it: includes, foreign elements, repeated names."""

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache, partial
from pathlib import Path, PurePosixPath

from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.document import parse_xml, unreadable_error
from asset2sim.assets.urdf.references import AllowedFolders, lies_outside
from asset2sim.intake.formats.format import included_in, unconvertible_error
from asset2sim.storage.regular_files import is_file

FOLDER_OF = {"mesh": "meshdir", "texture": "texturedir", "hfield": "meshdir", "skin": "meshdir"}
"""Asset → the compiler's attribute that names the folder of its files."""
FOLDERS = ("meshdir", "texturedir", "assetdir")
"""Attributes of MJCF's compiler that name folders of files."""
MOVES = re.compile(r"<(?:free)?joint\s[^>]*(?:name|axis|type)\s*=|<freejoint\b")
"""A joint of a body; defaults of joints seldom state one of these."""
NAMED = ("body", "joint", "geom", "site", "camera", "light", "mesh", "texture", "material", "hfield")
"""Elements whose names MuJoCo wants unique, each kind by itself."""
USERS = {"mesh": ("geom", "mesh"), "texture": ("material", "texture"), "hfield": ("geom", "hfield")}
"""Asset whose file may be missing → the element and the attribute that refer to it."""
MAX_INCLUDES = 200
MOST_RAD = 3.15
"""Largest number of a file's angles from which they are degrees: half a turn, and no part turns by 3°."""
UNREAD = ("sensor", "keyframe", "custom", "extension", "visual", "statistic")
"""Sections of which nothing is read."""
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""Type of a geom → how many sizes above 0 it needs; of two the second stands for ``fromto`` where that is stated."""
ATTRIBUTES = {"material": "material", "class": "default", "childclass": "default"}
"""Attribute → the kind of element that it names, without which what states it is whole all the same."""
ENDS = {"actuator": {"joint": "joint", "jointinparent": "joint", "tendon": "tendon", "body": "body", "site": "site"},
        "equality": {"joint1": "joint", "joint2": "joint", "body1": "body", "body2": "body", "tendon1": "tendon",
                     "tendon2": "tendon", "site1": "site", "site2": "site"},
        "contact": {"body1": "body", "body2": "body", "geom1": "geom", "geom2": "geom"},
        "fixed": {"joint": "joint"}, "spatial": {"site": "site", "geom": "geom"}}  # fmt: skip
"""Section or tendon → the attributes of what it holds that name elements, and their kinds."""
UNLISTED = ("frame", "replicate")
"""Elements that MuJoCo reads and that its printed schema leaves out."""


def mended_document(file: Path, reach: AllowedFolders) -> tuple[bytes, tuple[str, ...]]:
    """The file's text with its includes in place and absolute folders, without what MuJoCo refuses to read and pictures
    outside ``reach``, and a note for each thing that was changed. Raises AssetError (unreadable_asset) where it or an
    included file is no XML."""
    root = inlined(file)
    absolute_folders(root, file.parent)
    mends = (
        without_plugins,
        without_unknown,
        without_repeated_names,
        partial(without_missing_files, reach=reach),
        without_flat_geoms,
        in_order,
        without_dangling,
    )
    notes = [note for mend in mends for note in mend(root)]
    return etree.tostring(root), tuple(dict.fromkeys(notes))


def is_in_radians(file: Path) -> bool:
    """Whether a file that states no unit of angles, for which MuJoCo takes degrees, has them in radians, as one does
    that a program puts into a scene of its own: no angle is over half a turn, and some range is written with a point.
    Raises AssetError and ValueError for what cannot be read."""
    root = inlined(file)
    if any("angle" in compiler.attrib for compiler in root.iter("compiler")):
        return False
    ranges = [str(item.get("range", "")).split() for item in root.iter("joint") if item.get("type") != "slide"]
    turns = [word for words in ranges for word in words]
    others = [words[start:] for key, start in (("euler", 0), ("axisangle", 3))
              for words in (str(item.get(key, "")).split() for item in root.iter(etree.Element))]  # fmt: skip
    angles = [float(word) for word in (*turns, *(word for words in others for word in words))]
    exact = any("." in word and float(word) for word in turns)
    return exact and all(abs(angle) <= MOST_RAD for angle in angles)


def inlined(file: Path) -> Element:
    """The root with the content of every included file in its place; paths are relative to the outermost file."""
    root, included = parse_xml(file, "MJCF")[0], 0
    while (include := next(root.iter("include"), None)) is not None:
        included += 1
        name = str(include.get("file"))
        if included > MAX_INCLUDES:
            raise unreadable_error(
                file, "mjcf_refused", f"more than {MAX_INCLUDES} includes, '{name}' among them; break the circle"
            )
        place, parent = file.parent / name, include.getparent()
        if parent is None:
            raise unreadable_error(
                file, "mjcf_refused", "it is an <include> and nothing else: name the file of the model"
            )
        if not is_file(place):
            where = include.get("named_in") or f"line {include.sourceline}"
            problem = f"its include '{name}' ({where}) is not there: restore the file, or take the include out"
            raise unreadable_error(file, "mjcf_refused", problem)
        at, inner = parent.index(include), parse_xml(place, "MJCF")[0]
        for item in inner.iter("include"):
            item.set("named_in", f"{place.name}, line {item.sourceline}")
        parent[at : at + 1] = list(inner)
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


def without_plugins(root: Element) -> Iterator[str]:
    """Remove plugins, libraries that lie elsewhere; a note for each kind."""
    for plugin in [item for item in root.iter("plugin", "extension") if item.getparent() is not None]:
        if plugin.get("plugin"):
            yield f"plugin '{plugin.get('plugin')}' is left out"
        _remove(plugin)


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


def without_missing_files(root: Element, reach: AllowedFolders) -> Iterator[str]:
    """Drop assets whose file is not there and pictures outside ``reach``, and what refers to them: a material loses its
    texture, a mesh its geoms."""
    folders = {key: str(value) for compiler in root.iter("compiler") for key, value in compiler.attrib.items()}
    for asset, (user, attribute) in USERS.items():
        for element in list(root.iter(asset)):
            files = [str(value) for key, value in element.attrib.items() if str(key).startswith("file")]
            places, parent = [Path(folders.get(FOLDER_OF[asset], "")) / file for file in files], element.getparent()
            if parent is None or parent.tag != "asset":
                continue
            problems = [f"its file '{file}' is not there" for file, path in zip(files, places, strict=True)
                        if not is_file(path)]  # fmt: skip
            if asset == "texture":
                problems += [f"its file '{path.name}' {lies_outside(path, reach)}" for path in places
                             if not reach.allows(path)]  # fmt: skip
            if not problems:
                continue
            name = element.get("name") or Path(files[0]).stem
            parent.remove(element)
            yield f"{asset} '{name}' is left out: {problems[0]}"
            for item in [item for item in root.iter(user) if item.get(attribute) == name]:
                above = item.getparent()
                if user == "material":
                    del item.attrib[attribute]
                elif above is not None:
                    above.remove(item)


def without_flat_geoms(root: Element) -> Iterator[str]:
    """Remove geoms that state a size of 0 or less where their type needs one above."""
    for geom in list(root.iter("geom")):
        count, size = SIZES.get(str(geom.get("type", "")), 0), str(geom.get("size", "")).split()
        count -= count == SIZES["capsule"] and "fromto" in geom.attrib
        with suppress(ValueError):  # MuJoCo says what is no number
            if geom.getparent() is not None and any(float(word) <= 0.0 for word in size[:count]):
                _remove(geom)
                yield f"a {geom.get('type')} of size {geom.get('size')} is left out"


def in_order(root: Element) -> Iterator[str]:
    """Exchange the ends of joints' ranges where they are the wrong way round; one without length holds its joint."""
    for joint in list(root.iter("joint")):
        with suppress(ValueError):
            lower, upper = map(float, str(joint.get("range", "")).split())
            body, name = joint.getparent(), joint.get("name")
            if lower > upper:
                joint.set("range", f"{upper!r} {lower!r}")
                yield f"the range of joint '{name}' is the wrong way round, and turned"
            elif lower == upper != 0.0 and body is not None and body.tag == "body":
                body.remove(joint)
                yield f"joint '{name}' has a range without length: it is fixed"


def without_dangling(root: Element) -> Iterator[str]:
    """Remove the sections that are not read, what names elements that are not there, and attributes that do."""
    for element in [item for tag in UNREAD for item in root.findall(tag)]:
        root.remove(element)
    kinds = {*ATTRIBUTES.values(), *(kind for ends in ENDS.values() for kind in ends.values())}
    tags = {kind: (kind,) for kind in kinds} | {"tendon": ("fixed", "spatial"), "joint": ("joint", "freejoint")}
    names = {kind: {item.get("name") or item.get("class") for tag in tags[kind] for item in root.iter(tag)}
             for kind in kinds}  # fmt: skip
    names["body"].add("world")
    names["default"].add("main")
    for element in list(root.iter(etree.Element)):
        parent = element.getparent()
        ends = {} if parent is None else ENDS.get(str(parent.tag), {})
        for key, kind in (ATTRIBUTES | ends).items():
            name = element.get(key)
            if name is None or name in names[kind] or (element.tag == "default" and key == "class"):
                continue
            if key in ends:
                _remove(element)
                yield f"<{element.tag}> is left out: there is no {kind} '{name}'"
                break
            del element.attrib[key]
            yield f"there is no {kind} '{name}', which <{element.tag}> names"


def _remove(element: Element) -> None:
    parent = element.getparent()
    if parent is not None:
        parent.remove(element)


def check_files(file: Path, reach: AllowedFolders) -> bool:
    """Whether pictures that an MJCF file names, itself or in what it includes, lie outside ``reach``: MuJoCo reads them
    all. Raises AssetError (unreadable_asset) for any other file outside."""
    unread, read, outside = [file], set[Path](), False
    folders = {file.parent}
    while unread and not reach.anywhere:
        source = unread.pop()
        read.add(source)
        try:
            root = etree.parse(str(source)).getroot()
        except (etree.XMLSyntaxError, OSError):
            continue  # MuJoCo says what is wrong
        for compiler in root.iter("compiler"):
            folders |= {base / str(compiler.get(key)) for base in (file.parent, source.parent) for key in FOLDERS
                        if compiler.get(key)}  # fmt: skip
        named = {(str(text), item.tag == "texture") for item in root.iter(etree.Element)
                 for key, text in item.attrib.items()
                 if str(key).startswith("file") and item.tag != "joint"}  # fmt: skip
        for name, picture in sorted(named):
            paths = [folder / name for folder in sorted({*folders, source.parent}) if is_file(folder / name)]
            beyond = [path for path in paths if not reach.allows(path)]
            outside |= picture and bool(beyond)
            if beyond and not picture:
                raise unconvertible_error(
                    file, "outside_dataset", f"'{beyond[0].name}' {lies_outside(beyond[0], reach)}"
                )
            unread += [path for path in paths if path.suffix in (".xml", ".mjcf") and path not in {*read, *beyond}]
    return outside


def is_mjcf(head: bytes) -> bool:
    """Whether an XML file begins as MuJoCo's format does; what begins as ``<mujocoinclude>`` is a piece of others."""
    return re.search(rb"<mujoco[\s>]", head) is not None


def models_of(texts: Mapping[str, str]) -> list[str]:
    """The files that no other includes; but where such a file moves nothing by itself and includes one file that does,
    it is a scene around that one."""
    own = {PurePosixPath(name).name: name for name in texts}
    parts = {name: [own[file] for file in sorted(included_in(text)) if file in own] for name, text in texts.items()}
    inner = {file for name in texts for file in parts[name] if file != name}
    found = []
    for name in [name for name in texts if name not in inner] or texts:
        moving = [file for file in parts[name] if "<worldbody" in texts[file] and MOVES.search(texts[file])]
        found.append(moving[0] if len(moving) == 1 and not MOVES.search(texts[name]) else name)
    return list(dict.fromkeys(found))
