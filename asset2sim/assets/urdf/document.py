"""The URDF document as every reader of ours sees it: what origins write differently is brought to one form."""

import re
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.meshes.unusable import other_kind
from asset2sim.assets.urdf.joint_types import complete_limits, settle_joint_types, without_infinite_limits
from asset2sim.assets.urdf.mimic import drop_unusable_mimics
from asset2sim.assets.urdf.numbers import (
    PARTS,
    check_numbers,
    drop_unusable_contacts,
    drop_unusable_inertials,
    drop_unusable_shapes,
    info,
    name_files,
    thicken_plates,
    warning,
)
from schemas.errors import AssetError
from schemas.finding import Finding
from schemas.vocabulary import FailureMode

SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")
LISTS = ("xyz", "rpy", "size", "scale", "rgba")
"""Attributes that hold several numbers, which some exporters separate by commas."""
NAMED = ("link", "joint")
HARMLESS = {"NS_ERR_UNDEFINED_NAMESPACE"}
"""libxml2's name of a mistake that costs nothing: an undeclared prefix ..."""
UNDECLARED = re.compile(r"Namespace prefix (\S+) ")
"""... and how it says which."""
LONGEST_NAME = 255
"""Longest name of a robot, link or joint, bytes, as of a file: PyBullet dies of one of 5000."""
HEAD_BYTES = 512
"""Bytes by which a file of another kind is told."""
DECIMAL_COMMA = re.compile(r"(?=.*,)-?\d+(,\d+)?( +-?\d+(,\d+)?){2}")
"""Three numbers of which one has a comma for its point."""


@dataclass(frozen=True)
class Document:
    """A URDF's root element, comments kept, and a finding for each thing that was brought into form."""

    robot: Element
    findings: tuple[Finding, ...]


def read_document(path: Path) -> Document:
    """The document of a URDF. Raises AssetError: unreadable_asset where the file is not XML, not a URDF, or lacks a
    name, a parent or a child; invalid_joint_configuration for a joint type that is not simulated."""
    robot, recovered = parse_xml(path, "URDF")
    strip_namespace(robot)
    if robot.tag != "robot":
        raise unreadable_error(path, "not_urdf", f"the root element is <{robot.tag!s}>, not <robot>")
    findings = [warning(code="xml_recovered", message=f"{path.name}: {text}") for text in recovered]
    if not robot.get("name"):
        robot.set("name", path.resolve().parent.name)
        findings.append(info(code="robot_unnamed", message=f"<robot> has no name; it is called '{robot.get('name')}'"))
    without_commas(robot)
    check_names(path, robot)
    findings += without_infinite_limits(robot)
    check_numbers(path, robot)
    name_files(robot)
    findings += drop_unknown_shapes(robot)
    findings += drop_unusable_shapes(path, robot)
    findings += thicken_plates(robot)
    findings += drop_unusable_inertials(robot)
    findings += drop_unusable_contacts(robot)
    findings += settle_joint_types(path, robot)
    findings += complete_limits(robot)
    findings += drop_unusable_mimics(robot)
    return Document(robot, tuple(findings))


def known_robot(path: Path) -> Element:
    """The root of ``read_document``, brought into form once a content: each engine asks for an object's dynamics six
    times. Shared, so not to be changed. Raises AssetError as that does."""
    return _known_robot(path, path.read_bytes() if path.is_file() else b"")


def parse_xml(path: Path, kind: str) -> tuple[Element, tuple[str, ...]]:
    """The root element of a file as people write XML, and the first mistake in it that was passed over, with its line.

    Passed over is what takes nothing from the content: a version that XML does not have, hyphens in a comment, space
    or a comment before the declaration, an undeclared prefix. Raises AssetError (unreadable_asset) for anything else,
    naming the ``kind`` of file."""

    def not_xml(error: Exception) -> AssetError:
        try:
            with path.open("rb") as stream:
                other = other_kind(stream.read(HEAD_BYTES))
        except OSError:
            other = None
        if other is not None:
            return unreadable_error(path, "not_xml", f"it is a {other.replace('mesh', kind)}")
        said = getattr(error, "msg", None) or str(error)
        return unreadable_error(path, "not_xml", f"not readable as XML ({said}); export the {kind} again")

    try:
        return deepcopy(parsed_root(path)), ()
    except OSError as error:
        raise not_xml(error) from error
    except (etree.XMLSyntaxError, UnicodeError) as error:
        text = path.read_bytes()
        text = re.sub(rb"<!--.*?-->", lambda comment: b"\n" * comment.group().count(b"\n"), text, flags=re.DOTALL)
        text = re.sub(rb"\A(<\?xml\s+version=[\"'])0\.\d+", rb"\g<1>1.0", in_utf8(text.lstrip()))
        recovering, root = etree.XMLParser(remove_comments=False, recover=True), None
        with suppress(etree.XMLSyntaxError):  # there is nothing in it that could be recovered
            root = etree.fromstring(text, recovering)
        if root is None or {entry.type_name for entry in recovering.error_log} - HARMLESS:
            raise not_xml(error) from error
        # What is written of it is read again, by engines too, which refuse what is not declared.
        undeclared = {found[1] for entry in recovering.error_log if (found := UNDECLARED.match(entry.message))}
        if undeclared:
            declared = "".join(f' xmlns:{prefix}="{prefix}"' for prefix in sorted(undeclared)).encode()
            root = etree.fromstring(re.sub(rb"<[^\W\d][\w.:-]*", rb"\g<0>" + declared, text, count=1), recovering)
        return root, (f"{' '.join(str(error).split())[:120]}; passed over",)


def in_utf8(text: bytes) -> bytes:
    """An XML text in UTF-8 where it declares an encoding that only Python knows, as latin-1; any other as it is."""
    declared = re.match(rb"<\?xml[^>]*?(\s+encoding\s*=\s*[\"']([\w.:-]+)[\"'])", text)
    if declared is None:
        return text
    with suppress(LookupError, UnicodeError):
        return (text[: declared.start(1)] + text[declared.end(1) :]).decode(declared[2].decode()).encode()
    return text


def textures_of(robot: Element) -> list[Element]:
    """The texture elements of a URDF's materials, at its top and in its visuals."""
    return [*robot.iterfind("material/texture"), *robot.iterfind("link/visual/material/texture")]


def strip_namespace(robot: Element) -> None:
    """Take a default namespace off the tags that are in it; tags with a prefix keep theirs."""
    default = robot.nsmap.get(None)
    if default is None:
        return
    for element in robot.iter(etree.Element):
        name = etree.QName(element)
        if name.namespace == default:
            element.tag = name.localname
    etree.cleanup_namespaces(robot, keep_ns_prefixes=[key for key in robot.nsmap if key])


def without_commas(robot: Element) -> None:
    """Separate the numbers of lists by spaces alone."""
    for element in (inner for part in robot.iterchildren(*PARTS) for inner in part.iter(etree.Element)):
        for key in LISTS:
            text = element.get(key)
            if text is not None and "," in text and not DECIMAL_COMMA.fullmatch(text.strip()):
                element.set(key, text.replace(",", " "))


def check_names(path: Path, robot: Element) -> None:
    """Refuse links and joints without a name or with one that is too long, and joints without a parent or a child."""
    for tag in NAMED:
        for number, element in enumerate(robot.findall(tag), start=1):
            if not element.get("name"):
                raise unreadable_error(
                    path, "unnamed", f"<{tag}> number {number} (line {element.sourceline}) has no name"
                )
    for element in (robot, *robot.findall("link"), *robot.findall("joint")):
        name = str(element.get("name"))
        if len(name.encode()) > LONGEST_NAME:
            problem = (
                f"<{element.tag}> '{name[:30]}…' has a name of {len(name)} characters; {LONGEST_NAME} bytes are read"
            )
            raise unreadable_error(path, "name_too_long", f"{problem}: shorten it")
    for joint in robot.findall("joint"):
        missing = [tag for tag in ("parent", "child") if (end := joint.find(tag)) is None or not end.get("link")]
        if missing:
            raise invalid_joint_error(
                path, "incomplete_joint", str(joint.get("name")), f"it states no {' and no '.join(missing)}"
            )


def drop_unknown_shapes(robot: Element) -> list[Finding]:
    """Remove visuals and collisions without a shape that URDF knows; a finding for each."""
    findings = []
    for link in robot.findall("link"):
        for item in [*link.findall("visual"), *link.findall("collision")]:
            geometry = item.find("geometry")
            shapes = [] if geometry is None else list(geometry.iterchildren(etree.Element))
            if len(shapes) == 1 and shapes[0].tag in SHAPES:
                continue
            what = f"<{shapes[0].tag}>" if len(shapes) == 1 else f"{len(shapes)} shapes"
            name = str(link.get("name"))
            message = f"link '{name}': a {item.tag} holds {what}; it is left out: use one of {', '.join(SHAPES)}"
            findings.append(warning(code="unknown_shape", message=message, link=name))
            link.remove(item)
    return findings


def unreadable_error(path: Path, code: str, problem: str) -> AssetError:
    """An unreadable_asset error that names the file."""
    return AssetError(FailureMode.UNREADABLE_ASSET, code, f"{path.name}: {problem}")


def invalid_joint_error(path: Path, code: str, joint: str, problem: str) -> AssetError:
    """An invalid_joint_configuration error that names the file and the joint."""
    message = f"{path.name}: joint '{joint}': {problem}"
    return AssetError(FailureMode.INVALID_JOINT_CONFIGURATION, code, message, joint=joint)


KEPT = 8
"""Trees that are kept: an asset's own, and those of the last few URDFs that were written of it."""


def parsed_root(file: Path) -> Element:
    """The root element of a file as it is now, comments kept; shared, so not to be changed: copy it first. Raises
    OSError and etree.XMLSyntaxError."""
    return _parsed(file.read_bytes())


@lru_cache(maxsize=KEPT)
def _known_robot(path: Path, content: bytes) -> Element:
    return read_document(path).robot


@lru_cache(maxsize=KEPT)
def _parsed(content: bytes) -> Element:
    return etree.fromstring(content, etree.XMLParser(remove_comments=False))
