"""An asset's description, whatever its format and up axis: found in its folder and brought to a URDF that is read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory

import numpy as np
from lxml import etree
from scipy.spatial.transform import Rotation

from asset2sim.assets.formats.confine import confine, rename
from asset2sim.assets.formats.converted import Converted
from asset2sim.assets.urdf.allowed_folders import ANYWHERE, AllowedFolders, Refused, check_within
from asset2sim.assets.urdf.document import unreadable
from asset2sim.assets.urdf.edit import serialised, turn_root
from asset2sim.assets.urdf.locate import find_source, is_regular
from schemas.finding import Finding
from schemas.vocabulary import Severity, Stage, UpAxis

BESIDE = ("semantics.txt", "meta.json")
"""Files that say something of the asset to whoever reads the URDF beside them."""

TO_Z_UP: Mapping[UpAxis, tuple[tuple[int, int, int], ...]] = {
    UpAxis.Z: ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    UpAxis.Y: ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    UpAxis.MINUS_Y: ((0, 0, 1), (-1, 0, 0), (0, -1, 0)),
    UpAxis.MINUS_Z: ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    UpAxis.X: ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    UpAxis.MINUS_X: ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
}
"""The rotation that brings an object with this up axis upright. What is y-up faces +z by custom (glTF, Unity), and +x,
the front in ROS, once it is turned; PartNet-Mobility's objects face -x (``PARTNET_TURN``)."""
PARTNET_TURN = ((0, 0, -1), (-1, 0, 0), (0, 1, 0))


@dataclass(frozen=True)
class DescriptionFile:
    """An asset's description: the ``file`` in its folder, the ``urdf`` that is read (the file itself, or one made of it
    in a folder of its own, whose mesh references are absolute), all ``files`` that it was made of, and findings."""

    file: Path
    urdf: Path
    files: tuple[Path, ...]
    findings: tuple[Finding, ...] = ()
    refused: Mapping[str, Refused] = field(default_factory=dict)
    """Reference in ``urdf`` that is not read, since it means a file outside the dataset → what it was, and why."""
    work: TemporaryDirectory[str] | None = field(default=None, repr=False, compare=False)
    """The folder of a URDF that was made; it is deleted with the last reference to it."""


def open_source(folder: Path, up: UpAxis = UpAxis.Z, reach: AllowedFolders = ANYWHERE) -> DescriptionFile:
    """The asset's description as a URDF whose files lie within ``reach``, turned upright where another axis than z
    points up in it.

    Raises AssetError where it is missing, lies outside or cannot be converted."""
    file = check_within(find_source(check_within(folder, reach), reach.allows), reach)
    work = TemporaryDirectory(prefix="asset2sim-source-")
    place = Path(work.name)
    converted = CONVERTERS[file.suffix](file, place, reach)
    robot = converted.robot
    confined = confine(robot, file, replace(reach, roots=(*reach.roots, place.resolve())), place)
    if file.suffix == ".urdf" and up is UpAxis.Z and not confined.moved and is_utf8(robot):
        return DescriptionFile(file, file, (file,))
    rename(robot, confined)
    if not robot.get("name"):
        robot.set("name", file.resolve().parent.name)
    if up is not UpAxis.Z:
        turn_upright(robot, up, partnet=(folder / "semantics.txt").is_file())
    for name in BESIDE:
        if is_regular(folder / name) and reach.allows(folder / name):
            copyfile(folder / name, place / name)
    urdf = place / (file.name if file.suffix == ".urdf" else f"{file.name}.urdf")
    urdf.write_bytes(serialised(robot))
    findings = list(confined.findings)
    if up is not UpAxis.Z:
        message = f"its file has {up} up; what is written is turned about the root's origin so that z is up"
        findings.append(Finding(stage=Stage.EXTRACT, severity=Severity.INFO, code="up_axis", message=message))
    if file.suffix != ".urdf":
        said = "".join(f"; {note}" for note in converted.notes)
        message = f"read from {file.name}, of which a URDF was made{said}"
        code = f"converted_{converted.kind}"
        findings.append(Finding(stage=Stage.EXTRACT, severity=Severity.INFO, code=code, message=message))
    files = (file, *(path for path in converted.files if reach.allows(path)))
    return DescriptionFile(file, urdf, files, tuple(findings), confined.refused, work)


def is_utf8(robot: "etree._Element") -> bool:
    """Whether a URDF is encoded so that engines read its names, of whose declarations they take no notice."""
    encoding = robot.getroottree().docinfo.encoding
    return (encoding or "utf-8").lower() in ("utf-8", "utf8", "us-ascii", "ascii")


def turn_upright(robot: "etree._Element", up: UpAxis, *, partnet: bool) -> None:
    """Turn a whole URDF about its root's origin so that ``up``, an axis of its root link, becomes z."""
    children = {str(child.get("link")) for child in robot.iterfind("joint/child")}
    roots = [str(link.get("name")) for link in robot.findall("link") if link.get("name") not in children]
    turn = Rotation.from_matrix(np.array(TO_Z_UP[up]))
    if up is UpAxis.Y and (partnet or str(robot.get("name")).startswith("partnet_")):
        turn = Rotation.from_matrix(np.array(PARTNET_TURN))
    for root in roots:  # a tree has one; of others reading says what is wrong
        turn_root(robot, root, turn)


def parsed_urdf(file: Path, work: Path, reach: AllowedFolders) -> Converted:
    """The URDF itself. Raises AssetError: unreadable_asset."""
    try:
        return Converted(etree.parse(str(file)).getroot(), "urdf")
    except (etree.XMLSyntaxError, OSError, UnicodeError) as error:
        raise unreadable(file, "not_xml", f"not readable as XML ({error}); export the URDF again") from error


def _xacro(file: Path, work: Path, reach: AllowedFolders) -> Converted:
    from asset2sim.assets.formats.from_xacro import urdf_of_xacro

    return urdf_of_xacro(file, reach)


def _sdf(file: Path, work: Path, reach: AllowedFolders) -> Converted:
    from asset2sim.assets.formats.from_sdf import urdf_of_sdf

    return urdf_of_sdf(file)


def _mjcf(file: Path, work: Path, reach: AllowedFolders) -> Converted:
    from asset2sim.assets.formats.from_mjcf import urdf_of_mjcf  # late: an optional package, and half a second

    return urdf_of_mjcf(file, work, reach)


CONVERTERS: Mapping[str, Callable[[Path, Path, AllowedFolders], Converted]] = {
    ".urdf": parsed_urdf, ".xacro": _xacro, ".sdf": _sdf, ".xml": _mjcf,
}  # fmt: skip
