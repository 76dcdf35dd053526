"""Files that an SDF file includes, from the folders of Gazebo's models near it; the newest of a model's files."""

import re
from collections.abc import Mapping
from pathlib import Path

from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.document import parse_xml
from asset2sim.assets.urdf.references import MODEL_FILE, PARENTS_SEARCHED, AllowedFolders, lies_outside, path_in
from asset2sim.intake.formats.format import unconvertible_error
from asset2sim.storage.regular_files import is_file

VERSIONED = re.compile(r"(.*?)[-_](1[._]\d+)\.sdf$")
"""A file's name that says for which version of SDF it is, as Gazebo's models have it."""
FRAMED_AXES = (1, 4)
"""The last version of SDF in which axes are stated in their model's frame unless they say otherwise."""
MOST_INCLUDES = 1000


def version_of(document: Element) -> tuple[int, ...]:
    """The version of SDF that a document states, the newest that changed a frame where it states none."""
    return tuple(int(word) for word in str(document.get("version", "1.7")).split(".") if word.isdigit())


def included(holder: Element, file: Path, reach: AllowedFolders) -> tuple[list[Path], list[str]]:
    """Put the models that an SDF ``file`` includes, in a model or world, in the place of each ``<include>``: the files
    read, and the names of those that are not near it. Those merged hold the attribute ``merge``.

    Raises AssetError (unreadable_asset) for one outside ``reach``, and where they include each other in a circle."""
    files, missing, waiting = list[Path](), list[str](), [(item, file) for item in holder.iter("include")]
    while waiting:
        include, source = waiting.pop(0)
        uri, parent = (include.findtext("uri") or "").strip(), include.getparent()
        place = _model_file(uri, source.parent, reach) if uri else None
        if parent is None:
            continue
        if place is None:
            missing.append(uri)
            continue
        if not reach.allows(place):
            raise unconvertible_error(file, "outside_dataset", f"'{uri}' {lies_outside(place, reach)}")
        files.append(place)
        if len(files) > MOST_INCLUDES:
            raise unconvertible_error(
                file, "sdf_nested", f"over {MOST_INCLUDES} models are included, '{uri}' among them"
            )
        model = _model_in(place, include)
        if model is None:
            missing.append(uri)
            continue
        parent.replace(include, model)
        waiting += [(item, place) for item in model.iter("include")]
    return files, missing


def _model_in(place: Path, include: Element) -> Element | None:
    """The model of a file as an ``<include>`` has it: with its name and pose, its files by their own places."""
    document = parse_xml(place, "SDF")[0]
    model = document.find("model")
    if model is None:
        return None
    model.set("name", (include.findtext("name") or str(model.get("name"))).strip())
    for stated in [*include.findall("pose"), *include.findall("static")]:
        for old in model.findall(stated.tag):
            model.remove(old)
        model.append(stated)
    if placement := (include.findtext("placement_frame") or "").strip():
        model.set("placement_frame", placement)
    if str(include.get("merge")) in ("1", "true"):
        model.set("merge", "true")
    for uri in [uri for geometry in model.iter("geometry") for uri in geometry.iter("uri")]:
        if uri.text and "://" not in uri.text:
            uri.text = str(place.parent.resolve() / uri.text.strip())
    for axis in model.iter("axis", "axis2") if version_of(document) <= FRAMED_AXES else ():
        if axis.find("use_parent_model_frame") is None:
            etree.SubElement(axis, "use_parent_model_frame").text = "1"
    return model


def _model_file(uri: str, folder: Path, reach: AllowedFolders) -> Path | None:
    """The file of the model that a URI means: its folder is one of Gazebo's near ``folder``, or a path from there."""
    path = Path(path_in(uri).strip("/") or ".")
    named = (
        [reach.packages[path.parts[0]].joinpath(*path.parts[1:])]
        if path.parts[:1] and path.parts[0] in reach.packages
        else []
    )
    for place in (*named, *(base / path for base in (folder, *folder.resolve().parents[:PARENTS_SEARCHED]))):
        if place.suffix == ".sdf" and is_file(place):
            return place
        stated = []
        if reach.allows(place / MODEL_FILE) and is_file(place / MODEL_FILE):
            stated = [
                str(item.text or "").strip() for item in parse_xml(place / MODEL_FILE, "model.config")[0].iter("sdf")
            ]
        for name in (*sorted(stated, key=_age), "model.sdf"):
            if name and is_file(place / name):
                return place / name
    return None


def _age(name: str) -> tuple[bool, list[int]]:
    """Key by which the newest of a model's files is the first: that without a version, else the highest."""
    numbers = [-int(word) for word in re.findall(r"\d+", name)]
    return bool(numbers), numbers


def newest(texts: Mapping[str, str]) -> list[str]:
    """Of files of one model in several versions of SDF (``door-1_4.sdf``) the newest; other files as they are."""
    found: dict[str, tuple[tuple[int, ...], str]] = {}
    for name in texts:
        versioned = VERSIONED.match(name)
        base, version = versioned.groups() if versioned else (name.removesuffix(".sdf"), "9")
        number = tuple(int(word) for word in re.findall(r"\d+", version))
        found[base] = max(found.get(base, ((), "")), (number, name))
    return [name for _, name in found.values()]
