"""xacro to URDF, by the package of that name, without ROS."""

import os
import re
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import xacro
from lxml import etree
from xacro import substitution_args

from asset2sim.assets.urdf.references import ANYWHERE, PARENTS_SEARCHED, AllowedFolders, lies_outside
from asset2sim.intake.formats.format import Converted, Format, outermost_files, unconvertible_error
from asset2sim.intake.formats.sdf import urdf_of_sdf
from asset2sim.intake.formats.xacro_expressions import evaluated
from schemas.errors import AssetError

PACKAGE_FOLDERS = ("urdf", "xacro", "robots", "robot", "description")
"""Folders of a ROS package in which its xacro files lie."""
HANGS_ON = "world"
GUESSED = {"parent": HANGS_ON, "parent_link": HANGS_ON, "name": "object",
           **dict.fromkeys(("prefix", "ns", "namespace", "tf_prefix"), "")}  # fmt: skip
"""Arguments of macros without a default that can be guessed: what an object hangs on, how its names begin."""
STATES = {"macro": "name", "property": "name", "arg": "name", "include": "filename", "insert_block": "name",
          "if": "value", "unless": "value"}  # fmt: skip
"""xacro's own elements and an attribute of each: by both they are known where files do without their prefix."""
FOREIGN = ("gazebo", "transmission")
"""Elements of a URDF whose content is another program's."""
WITHOUT_PREFIX = "its elements of xacro are written without the prefix 'xacro:', as xacro once took them"
POSES = ("*origin", "*pose")
"""Blocks of macros that say where an object hangs."""


def urdf_of_xacro(file: Path, work: Path, reach: AllowedFolders = ANYWHERE) -> Converted:
    """The URDF of a xacro file of a URDF or SDF, its arguments at their defaults. Raises AssetError
    (unreadable_asset) that names the file and, where it can be told, the line; also for what it includes that lies
    outside ``reach``."""
    xacro.all_includes.clear()
    with (
        _packages_beside(file, substitution_args, reach),
        _only_within(reach, xacro),
        _bounded_expressions(xacro, substitution_args),
        _with_prefixes(xacro) as bare,
    ):
        try:
            document = xacro.process_file(str(file.resolve()))
            made = instance_of(file, xacro, reach.macro) if not document.getElementsByTagName("link") else None
            document = document if made is None else made[0]
        except AssetError:
            raise
        except Exception as error:  # xacro evaluates Python: an expression may raise anything
            raise _located(error, file, [Path(name) for name in (xacro.filestack or [str(file)])]) from error
    robot = etree.fromstring(document.toxml().encode())
    includes = tuple(Path(name) for name in dict.fromkeys(xacro.all_includes) if Path(name).is_file())
    notes = (
        "its arguments have their defaults",
        *(() if made is None else made[1:]),
        *([WITHOUT_PREFIX] if bare else []),
    )
    if robot.tag == "sdf":
        resolved = work / f"{file.name.removesuffix('.xacro').removesuffix('.sdf')}.sdf"
        resolved.write_bytes(etree.tostring(robot))
        made_of = urdf_of_sdf(file, work, reach, resolved)
        return replace(made_of, files=(*includes, *made_of.files), notes=(*notes, *made_of.notes))
    return Converted(robot, includes, notes)


def instance_of(file: Path, module: Any, chosen: str = "") -> tuple[Any, str] | None:
    """The document of a xacro file that only defines macros, with one instance: of the ``chosen`` one, else of the one
    that no other uses, its arguments at their defaults or guessed; and a note. None where it defines none. Raises
    AssetError (unreadable_asset), which lists the macros, where there are several, and names the arguments that have
    no default."""
    roots = [etree.parse(name).getroot() for name in dict.fromkeys((str(file), *module.all_includes))]
    found = [item for root in roots for item in root.iter(etree.Element)]
    macros = {str(item.get("name")).removeprefix("xacro:"): item for item in found if is_named(item, "macro")}
    used = {str(etree.QName(item).localname) for item in found}
    whole = [name for name in macros if name not in used or name == chosen]
    if not whole:
        return None
    listed = "; ".join(f"{name} ({macros[name].get('params') or 'no arguments'})" for name in whole)
    remedy = "add an instance of one, as <xacro:{} …/>, or name its URDF"
    if (chosen and chosen not in macros) or (not chosen and len(whole) > 1):
        problem = f"it has no link, only macros{f', and none of them is {chosen!r}' if chosen else ''}: {listed}"
        raise unconvertible_error(file, "xacro_macros", f"{problem}; name one by --macro, or {remedy.format(whole[0])}")
    name = chosen or whole[0]
    values, blocks, unknown = arguments_of(str(macros[name].get("params", "")))
    if unknown:
        problem = f"its macro {name} ({macros[name].get('params')}) has no default for {', '.join(unknown)}"
        raise unconvertible_error(
            file, "xacro_macros", f"{problem}: give it one, as NAME:=VALUE, or {remedy.format(name)}"
        )
    module.init_stacks(str(file.resolve()))
    document = module.parse(None, str(file.resolve()))
    instance = document.createElement(f"xacro:{name}")
    for argument, value in values.items():
        instance.setAttribute(argument, value)
    for _ in range(blocks):
        instance.appendChild(document.createElement("origin"))
    document.documentElement.appendChild(instance)
    module.process_doc(document)
    links = {item.getAttribute("name") for item in document.getElementsByTagName("link")}
    ends = [item.getAttribute("link") for item in document.getElementsByTagName("parent")]
    for missing in dict.fromkeys(end for end in ends if end and end not in links):  # it hangs on another file's link
        link = document.createElement("link")
        link.setAttribute("name", missing)
        document.documentElement.appendChild(link)
    return document, f"it only defines the macro {listed}, of which one instance is made"


def arguments_of(params: str) -> tuple[dict[str, str], int, list[str]]:
    """The guessed values of a macro's arguments without a default, the number of its blocks that are poses, and the
    arguments that cannot be guessed."""
    values, blocks, unknown = dict[str, str](), 0, list[str]()
    for word in re.findall(r"[^\s:=]+(?::?=(?:'[^']*'|\S*))?", params):
        if word in POSES:
            blocks += 1
        elif word.startswith("*") or ("=" not in word and word not in GUESSED):
            unknown.append(word)
        elif "=" not in word:
            values[word] = GUESSED[word]
    return values, blocks, unknown


def is_named(element: Any, name: str) -> bool:
    """Whether an element is xacro's of this name, with its prefix or without."""
    tag = etree.QName(element)
    return tag.localname == name and (tag.namespace is None or tag.namespace.endswith("xacro"))


@contextmanager
def _packages_beside(file: Path, substitution: Any, reach: AllowedFolders) -> Iterator[None]:
    """While it lasts, ``$(find NAME)`` means a folder near the file, not a package that ROS has installed, and
    ``$(env NAME)`` finds nothing but where all may be read: the environment holds keys."""
    places = [file.resolve().parent, *file.resolve().parents[1 : PARENTS_SEARCHED + 1]]
    folders = [place for place in places if reach.allows(place)] or places[:1]

    def find(name: str) -> str:
        return str(reach.packages.get(name) or find_package(name, folders))

    kept = substitution._eval_find, substitution.os
    substitution._eval_find = substitution._eval_dict["find"] = find
    if not reach.anywhere:
        substitution.os = SimpleNamespace(**{**vars(os), "environ": {}})
    try:
        yield
    finally:
        substitution._eval_find = substitution._eval_dict["find"] = kept[0]
        substitution.os = kept[1]


@contextmanager
def _only_within(reach: AllowedFolders, module: Any) -> Iterator[None]:
    """While it lasts, xacro opens no file outside ``reach``: neither what it includes nor what it loads."""
    kept = module.abs_filename_spec, module.parse

    def within(path: str) -> str:
        if not reach.allows(Path(path)):
            raise ValueError(f"'{path}' {lies_outside(Path(path), reach)}")
        return path

    def named(path: str) -> str:
        return str(within(kept[0](path)))

    def parsed(inp: Any, filename: str | None = None) -> Any:
        return kept[1](inp, filename if filename is None else within(filename))

    module.abs_filename_spec, module.parse = named, parsed
    try:
        yield
    finally:
        module.abs_filename_spec, module.parse = kept


@contextmanager
def _with_prefixes(module: Any) -> Iterator[set[str]]:
    """While it lasts, a robot's files may name xacro's elements and their own macros without the prefix, also macros of
    files that are read later. The names that were written so."""
    kept, macros, documents, bare = module.parse, set[str](), list[Any](), set[str]()

    def parsed(inp: Any, filename: str | None = None) -> Any:
        document = kept(inp, filename)
        if document.documentElement.tagName == "robot":
            documents.append(document)
            own = (element.getAttribute("name") for element in document.getElementsByTagName("macro"))
            macros.update(name.removeprefix("xacro:") for name in own)
            for each in documents:
                _add_prefixes(each.documentElement, macros, bare)
        return document

    module.parse = parsed
    try:
        yield bare
    finally:
        module.parse = kept


def _add_prefixes(parent: Any, macros: Collection[str], bare: set[str]) -> None:
    """Give xacro's elements below this one, and uses of these macros, the prefix that they lack; their names are added
    to ``bare``."""
    for element in parent.childNodes:
        if element.nodeType != element.ELEMENT_NODE or element.tagName in FOREIGN:
            continue
        if element.tagName in macros or element.hasAttribute(STATES.get(element.tagName, "")):
            bare.add(element.tagName)
            element.tagName = element.nodeName = f"xacro:{element.tagName}"
        _add_prefixes(element, macros, bare)


@contextmanager
def _bounded_expressions(module: Any, substitution: Any) -> Iterator[None]:
    """While it lasts, ``${…}`` and ``$(eval …)`` take bounded time, and ``$(dirname)`` is the folder of the file that
    is read."""
    kept = module.safe_eval, substitution._eval_dirname

    def value(expression: str, names: dict[str, Any], local: Any = None) -> Any:
        dict.update(names, __builtins__={})
        return evaluated(expression, names, local)

    module.safe_eval = value
    substitution.eval = evaluated
    substitution._eval_dirname = lambda _: str(Path(module.filestack[-1]).resolve().parent)
    try:
        yield
    finally:
        module.safe_eval, substitution._eval_dirname = kept
        del substitution.eval


def find_package(name: str, folders: list[Path]) -> Path:
    """A ROS package's folder: of the xacro's own folder and those above it the first that has its name, states it in
    its package.xml, or holds a folder of it. Else, as for meshes, the name counts for nothing: an asset's folder may be
    called otherwise, and is the package then."""
    for folder in folders:
        if folder.name == name or _states(folder / "package.xml", name):
            return folder
        if (folder / name).is_dir():
            return folder / name
    return folders[1] if folders[0].name in PACKAGE_FOLDERS and len(folders) > 1 else folders[0]


def _states(manifest: Path, name: str) -> bool:
    try:
        return re.search(rf"<name>\s*{re.escape(name)}\s*</name>", manifest.read_text(errors="replace")) is not None
    except OSError:
        return False


def _located(error: Exception, file: Path, stack: list[Path]) -> AssetError:
    """The error with the file in which it arose, and the line: the parser's, or the first with what xacro quotes."""
    place = stack[-1]
    line = getattr(error, "lineno", None)
    text = " ".join(str(error).split())
    if line is None and place.is_file():
        quoted = [word for pair in re.findall(r"'([^']+)'|\"([^\"]+)\"|<([\w:]+)>", text) for word in pair if word]
        unquoted = [word.strip(".:") for word in re.findall(r"[\w:.$/{}()]+", text) if len(word) > 3]
        lines = place.read_text(errors="replace").splitlines()
        for word in (*sorted(quoted, key=len, reverse=True), *sorted(unquoted, key=len, reverse=True)):
            line = next((number for number, content in enumerate(lines, 1) if word in content), None)
            if line is not None:
                break
    named = place.name if place.name == file.name else f"{file.name}: in {place.name}"
    where = f"{named}, line {line}" if line is not None else named
    problem = f"xacro cannot be resolved: {text or type(error).__name__}; mend it, or run xacro and keep its URDF"
    error_ = unconvertible_error(file, "xacro_unresolved", problem)
    return AssetError(error_.mode, error_.code, f"{where}: {problem}")


def whole(texts: Mapping[str, str]) -> list[str]:
    """The ``.urdf.xacro``, or the files that no other includes."""
    found = outermost_files(texts)
    return [file for file in found if file.endswith(".urdf.xacro")] or found


FORMAT = Format("xacro", ".xacro", 1, urdf_of_xacro, of_several=whole)
