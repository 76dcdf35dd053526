"""An asset's description, whatever its format and up axis: found in its folder and brought to a URDF that is read."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory

import numpy as np
from lxml import etree
from scipy.spatial.transform import Rotation

from asset2sim.assets.extract import DescriptionFile, Extraction, folder_of, read_asset
from asset2sim.assets.urdf.edit import serialised, turn_root
from asset2sim.assets.urdf.read import PARTNET_TURN, element_joint
from asset2sim.assets.urdf.references import ANYWHERE, AllowedFolders, allowed_folders, check_within
from asset2sim.intake.confine import confine, rename
from asset2sim.intake.formats import FORMATS
from asset2sim.intake.formats.format import Converted, add_child, unconvertible_error
from asset2sim.intake.locate import find_source
from asset2sim.intake.robots import without_bystanders, without_robots
from asset2sim.intake.split import Part, cut_out, parts_of, passing
from asset2sim.storage.regular_files import is_file
from schemas.asset import AssetRef
from schemas.finding import remark, warning
from schemas.inputs import InputSettings
from schemas.vocabulary import Stage, UpAxis

INPUTS = InputSettings()
HINGES = ("revolute", "continuous")
IN_ONE_POINT_M = 1e-6
"""Distance of two hinges' origins, m, below which they are one: converters write zeros."""
MOST_IN_ONE_POINT = 3
"""Hinges of a ball joint."""
ALONG = 0.98
"""Cosine of the angle between two axes, 11°, above which they are one pin."""
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


def parts_in(ref: AssetRef, up: UpAxis, inputs: InputSettings) -> tuple[Part, ...]:
    """The parts of a scene, upright; none of a single object. Raises AssetError as ``open_origin`` does."""
    reach = allowed_folders(ref, inputs)
    file = check_within(find_source(check_within(Path(ref.path), reach), reach.allows), reach)
    with TemporaryDirectory(prefix="asset2sim-source-") as work:
        converted = without_robots(FORMATS[file.suffix].converter(file, Path(work), reach))
    if up is not UpAxis.Z:
        turn_upright(converted.robot, up, partnet=False)
    return parts_of(converted)


def open_origin(
    asset: Path, up: UpAxis = UpAxis.Z, reach: AllowedFolders = ANYWHERE, part: str | None = None
) -> DescriptionFile:
    """The description of an asset, named by its folder or file, as a URDF whose files lie within ``reach``, turned
    upright where another axis than z points up in it; of a scene this ``part``.

    Raises AssetError where it is missing, lies outside or cannot be converted, and where it has no such part."""
    file, folder = check_within(find_source(check_within(asset, reach), reach.allows), reach), folder_of(asset)
    work = TemporaryDirectory(prefix="asset2sim-source-")
    place = Path(work.name)
    converted = without_robots(FORMATS[file.suffix].converter(file, place, reach))
    if part is None and FORMATS[file.suffix].name == "MJCF":  # of which tasks are made; worlds and stages are scenes
        converted = without_bystanders(converted)
    robot = converted.robot
    crossed = crossing(robot)
    for first, second in crossed:
        add_child(robot, "disable_collisions", link1=first, link2=second, reason="Adjacent")
    confined = confine(robot, file, replace(reach, work=(place.resolve(),)), place)
    as_it_is = not converted.notes and not confined.moved and is_utf8(robot) and part is None and not crossed
    if file.suffix == ".urdf" and up is UpAxis.Z and as_it_is:
        return DescriptionFile(file, file, (file,))
    rename(robot, confined)
    if not robot.get("name"):
        robot.set("name", file.resolve().parent.name)
    if up is not UpAxis.Z:
        turn_upright(robot, up, partnet=(folder / "semantics.txt").is_file())
    robot = one_object(file, converted, part)
    for name in BESIDE if part is None else ():
        if is_file(folder / name) and reach.allows(folder / name):
            copyfile(folder / name, place / name)
    urdf = place / (file.name if file.suffix == ".urdf" else f"{file.name}.urdf")
    urdf.write_bytes(serialised(robot))
    findings = list(confined.findings)
    if up is not UpAxis.Z:
        message = f"its file has {up} up; what is written is turned about the root's origin so that z is up"
        findings.append(remark(Stage.EXTRACT, "up_axis", message))
    if file.suffix == ".urdf":
        told = (f"{file.name}: {note}" for note in converted.notes)
        findings += [warning(Stage.EXTRACT, "xml_recovered", text) for text in told]
    else:
        said = "".join(f"; {note}" for note in converted.notes)
        message = f"read from {file.name}, of which a URDF was made{said}"
        code = f"converted_{FORMATS[file.suffix].name.lower()}"
        findings.append(remark(Stage.EXTRACT, code, message))
    files = (file, *(path for path in converted.files if reach.allows(path)))
    form = FORMATS[file.suffix]
    scene = part is None and bool(converted.free)
    held, stood = (converted.held, converted.stood) if part is None else ("", "")
    metric = form.name if form.metric and converted.metric else "a scene" if part is not None else ""
    made, sized = tuple(findings), converted.sized
    return DescriptionFile(file, urdf, files, made, confined.refused, work, metric, scene, up, held, stood, sized)


def one_object(file: Path, converted: Converted, part: str | None) -> "etree._Element":
    """The URDF of a whole file, or of one part of its scene. Raises AssetError for a part that is not there, and for a
    whole of several objects that nothing holds."""
    robot = converted.robot
    if part is None:
        loose = [str(end.get("link")) for end in robot.iterfind("joint[@type='floating']/child")]
        if converted.world and loose:
            problem = f"it has several objects that nothing holds ({', '.join(loose)}): cut it by --split, or keep one"
            raise unconvertible_error(file, f"{FORMATS[file.suffix].name.lower()}_objects", problem)
        for first, second in passing(parts_of(converted)) if converted.free else ():
            add_child(robot, "disable_collisions", link1=first, link2=second, reason="Never")
        return robot
    chosen = next((item for item in parts_of(converted) if item.name == part), None)
    if chosen is None:
        raise unconvertible_error(file, "no_such_part", f"it has no part '{part}' any more; refine it again")
    return cut_out(converted, chosen)


def crossing(robot: "etree._Element") -> list[tuple[str, str]]:
    """Pairs of links that two hinges one after the other join in one point, as those of a universal joint, a ball or a
    hose's segments: they touch there as a link and its parent do, whose contacts engines leave out."""
    try:
        turns = [joint for joint in map(element_joint, robot.findall("joint")) if joint.type in HINGES]
    except ValueError:
        return []  # reading it says what is wrong
    above, found = {joint.child: joint for joint in turns}, list[tuple[str, str]]()
    for joint in turns:
        below = joint
        for _ in range(MOST_IN_ONE_POINT - 1):
            upper = above.get(below.parent)
            if upper is None or np.linalg.norm(below.child_to_parent[:3, 3]) > IN_ONE_POINT_M:
                break
            if abs(float(below.child_to_parent[:3, :3] @ below.axis @ upper.axis)) > ALONG:
                break  # leaves on one pin push each other
            found.append((upper.parent, joint.child))
            below = upper
    return found


def extract(
    ref: AssetRef, cache: Path | None = None, up: UpAxis = UpAxis.Z, inputs: InputSettings = INPUTS
) -> Extraction:
    """Features and geometry of one asset, in whatever format, with ``up`` the axis that points up in its file; see
    ``read_asset``. Raises AssetError."""
    reach = allowed_folders(ref, inputs)
    return read_asset(ref, open_origin(Path(ref.path), up, reach, ref.part), reach, cache, inputs)


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
        turn = Rotation.from_matrix(PARTNET_TURN)
    for root in roots:  # a tree has one; of others reading says what is wrong
        turn_root(robot, root, turn)
