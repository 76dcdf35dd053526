"""The whole asset: links, joints, boxes at rest and closed, and the hash of what was read."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yourdfpy
from lxml import etree
from scipy.optimize import linear_sum_assignment

from asset2sim.assets.companions import companions_of, read_category, read_semantics
from asset2sim.assets.joints import believed_limits, read_joint, with_ends
from asset2sim.assets.links import LinkGeometry, MeshReader, read_link, with_shared_walls
from asset2sim.assets.meshes.openness import DrawnTree
from asset2sim.assets.meshes.shape_cache import read_shapes, write_shapes
from asset2sim.assets.meshes.triangles import Triangles
from asset2sim.assets.meshes.volume import smallest_rectangle
from asset2sim.assets.metric import metric_evidence
from asset2sim.assets.urdf.document import read_document, textures_of
from asset2sim.assets.urdf.mesh_files import material_files
from asset2sim.assets.urdf.mimic import coupled, with_followed_ends
from asset2sim.assets.urdf.read import front_of, read_contacts, read_dynamics, read_starts, read_urdf, root_of
from asset2sim.assets.urdf.references import AllowedFolders, Refused
from asset2sim.guidance.category import named_in_file
from asset2sim.physics.arrays import Array, floats_of
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from asset2sim.storage.regular_files import is_file
from schemas.asset import AssetRef
from schemas.authored import kept_share
from schemas.base import Vector3
from schemas.errors import AssetError
from schemas.features import Features, JointFeatures, LinkFeatures
from schemas.finding import Finding, warning
from schemas.inputs import InputSettings
from schemas.vocabulary import FailureMode, Keep, Quantity, Stage, UpAxis

INPUTS = InputSettings()
SMALLEST_M = 1e-5
"""Size, m, of what is no object: one of a centimetre, written in kilometres."""
MOST_SPREAD = 1000.0
"""Size of an object over its largest part's from which an origin is wrong: the longest chains have 127 parts."""


@dataclass(frozen=True)
class DescriptionFile:
    """Where an asset came from: the ``file`` in its folder, the ``urdf`` that is read (the file itself, or one made of
    it in a folder of its own, whose mesh references are absolute), all ``files`` that it was made of, and findings."""

    file: Path
    urdf: Path
    files: tuple[Path, ...]
    findings: tuple[Finding, ...] = ()
    refused: Mapping[str, Refused] = field(default_factory=dict)
    """Reference in ``urdf`` that is not read, since it means a file outside the dataset → what it was, and why."""
    work: TemporaryDirectory[str] | None = field(default=None, repr=False, compare=False)
    """The folder of a URDF that was made; it is deleted with the last reference to it."""
    metric_format: str = ""
    """The name of its format where that says that lengths are metres."""
    scene: bool = False
    """Whether it holds several objects, some of them free of the world that holds the others."""
    up: UpAxis = UpAxis.Z
    """The axis that points up in the file."""
    held: str = ""
    """Why the file holds the object where it is, in words; empty where it leaves that open."""
    stood: str = ""
    """How the file stands the object, fixed, on what is no part of it, in words; empty where it does not."""
    sized: bool = False
    """Whether its loader brings it to another size than it is drawn in."""


TURNED = 0.75
"""Share of the floor that its box along the axes takes below which an object stands turned among them: a kettle whose
spout points along an axis takes more."""
FOOT_SHARE = 0.05
"""Height over the lowest point, as a share of a link's, within which it stands: its foot ..."""
OFF_CENTRE = 0.1
"""... whose middle is off the link's by this share of its box or more where that counts."""
TIGHTER = 0.95
"""Share of the area of a box along the root's axes below which one in a link's own frame counts as tighter."""


def hash_files(files: Iterable[Path], *texts: str) -> str:
    """SHA-256 over file names and bytes, sorted by name, and over ``texts``; 64 hex digits."""
    digest = hashlib.sha256()
    for file in sorted(set(files)):
        digest.update(file.name.encode())
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    for text in texts:
        digest.update(b"\x00" + text.encode())
    return digest.hexdigest()


@dataclass(frozen=True)
class Extraction:
    """Features, with data that later stages need and no table holds. ``urdf`` is what is read: the asset's own, or one
    that was made of it. ``geometry`` maps link → its hull points and convex pieces, ``mesh_files`` mesh reference →
    file, or None if missing."""

    folder: Path
    urdf: Path
    features: Features
    findings: tuple[Finding, ...]
    geometry: dict[str, LinkGeometry]
    mesh_files: dict[str, Path | None]
    links: Mapping[str, yourdfpy.Link] = field(default_factory=dict, repr=False, compare=False)
    """Name → link as ``urdf`` states it, no mesh loaded."""
    hierarchies: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)
    """Link → its triangle hierarchy for ``collision.cause``, filled on demand; None for a link without triangles."""
    triangles: Triangles = field(default_factory=Triangles, repr=False, compare=False)
    """Triangles of ``mesh_files``, loaded on demand; the last user calls ``keep`` to store them."""

    opened: DescriptionFile | None = field(default=None, repr=False, compare=False)
    companions: dict[str, Path] = field(default_factory=dict, repr=False, compare=False)
    """PartNet-Mobility's files beside the URDF, by name."""
    presses: dict[Any, float] = field(default_factory=dict, repr=False, compare=False)
    """How deep fingers press parts, filled on demand by ``validation.pressed``."""

    @property
    def source(self) -> Path:
        """The file in the asset's folder that describes it: the URDF, or of what it was made."""
        return self.urdf if self.opened is None else self.opened.file


def drawn_tree(extraction: Extraction, joints: Sequence[JointFeatures]) -> DrawnTree:
    """These joints of the object with its links' points, at the authored scale."""
    points = {name: item.points for name, item in extraction.geometry.items()}
    return DrawnTree(tree_of(joints), extraction.features.root, points)


def folder_of(place: Path) -> Path:
    """An asset's folder, where the asset is named by its folder or by the file that describes it."""
    return place.parent if is_file(place) else place


def read_asset(
    ref: AssetRef,
    opened: DescriptionFile,
    reach: AllowedFolders,
    cache: Path | None = None,
    inputs: InputSettings = INPUTS,
) -> Extraction:
    """Features and geometry of one asset whose description is ``opened``.

    ``cache`` is a folder in which the shapes and the triangles of its meshes are kept, so that those of unchanged files
    are not computed again; the result is the same with it and without. Only files that ``reach`` and ``inputs`` allow
    are read. Raises AssetError: unreadable_asset (not a tree), missing_mesh (a link none of whose meshes is there),
    invalid_joint_configuration (joint numbers that make no sense)."""
    folder = folder_of(Path(ref.path))
    urdf = opened.urdf
    robot = read_urdf(urdf)
    base = urdf.parent
    store = cache / f"{ref.asset_id}.npz" if cache is not None else None
    triangles = Triangles(cache / f"{ref.asset_id}.triangles.npz" if cache is not None else None)
    document = read_document(urdf)
    told = [*opened.findings, *document.findings]
    known = read_shapes(store) if store is not None else {}
    reader = MeshReader(base, triangles, told, known=known, refused=opened.refused, reach=reach)
    reader.largest_mb, reader.origin = inputs.max_mesh_mb, opened.file.parent
    companions, left_out = companions_of(folder, reach)
    told += left_out
    labels = read_semantics(companions.get("semantics.txt"))
    contacts, starts = read_contacts(document.robot), read_starts(document.robot)
    links: list[LinkFeatures] = []
    geometry: dict[str, LinkGeometry] = {}
    for link in robot.links:
        kind, label = labels.get(link.name, ("", ""))
        link_features, geometry[link.name] = read_link(link, label, kind, reader)
        links.append(link_features.model_copy(update={"contact": contacts.get(link.name)}))
    if store is not None and reader.met.keys() != reader.known.keys():
        write_shapes(store, reader.met)
    points = {name: item.points for name, item in geometry.items()}
    if not any(len(cloud) for cloud in points.values()):
        raise AssetError(FailureMode.MISSING_MESH, "no_geometry", f"{urdf.name}: no link has any geometry")
    longest = max(float(np.ptp(cloud, axis=0).max()) for cloud in points.values() if len(cloud))
    stated = [believed_limits(read_joint(joint, urdf), longest) for joint in robot.joints]
    joints, narrowed = coupled([joint for joint, _ in stated])
    reader.findings.extend(finding for _, finding in stated if finding is not None)
    reader.findings.extend(narrowed)
    tree = tree_of(joints)
    root = root_of(robot)
    rest = link_to_root(tree, root, {})
    links = with_shared_walls(links, geometry, tree, root)
    low, high = bounds(points, rest)
    diagonal = float(np.linalg.norm(high - low))
    check_spread(urdf, points, diagonal)
    drawn = DrawnTree(tree, root, points)
    joints = with_followed_ends([with_ends(joint, drawn, rest, diagonal) for joint in joints])
    springs = {name: own.stiffness for name, own in read_dynamics(urdf).items() if own.stiffness}
    beyond = {joint.name: {"start": starts.get(joint.name), "stiffness": springs.get(joint.name)} for joint in joints}
    joints = [joint.model_copy(update=beyond[joint.name]) for joint in joints]
    closed = {joint.name: joint.closed for joint in joints if joint.closed is not None}
    closed_size = floats_of(standing_edges(placed(points, link_to_root(tree, root, closed))))
    told += find_textures(document.robot, reader)
    files = [path for path in reader.files.values() if path is not None]
    looks = [companion for file in files for companion in material_files(file)]
    beside = [companions[name] for name in ("semantics.txt", "meta.json") if name in companions]
    keep = ref.keep or inputs.keep
    size_kept = kept_share(keep, Quantity.SIZE)
    # A part of a scene has its size whatever else is kept of it.
    size_kept = Keep.PLAUSIBLE if size_kept is Keep.NOTHING and ref.part is not None else size_kept
    size_kept = Keep.NOTHING if size_kept is Keep.PLAUSIBLE and opened.sized else size_kept
    features = Features(
        asset_id=ref.asset_id,
        category=ref.category
        or read_category(companions.get("meta.json"))
        or named_in_file(ref.asset_id, str(robot.name or ""), [link.name for link in links if link.has_geometry]),
        urdf_file=opened.file.name,
        root=root,
        links=tuple(links),
        joints=tuple(joints),
        rest_box_min=floats_of(low),
        rest_box_max=floats_of(high),
        closed_size=closed_size,
        link_centers={name: box_center(rest[name], cloud) for name, cloud in points.items() if len(cloud)},
        link_boxes={name: box_edges(rest[name], cloud) for name, cloud in points.items() if len(cloud)},
        link_feet={
            name: foot
            for name, cloud in points.items()
            if len(cloud) and (foot := foot_share(apply(rest[name], cloud))) is not None
        },
        content_hash=hash_files([*opened.files, *files, *looks, *beside]),
        front=floats_of(front_of(robot, urdf)),
        metric=metric_evidence(
            opened.metric_format,
            links,
            size_kept,
            document.robot,
            closed_size,
            floats_of(high - low),
            unit_stated=reader.unit_stated,
        ),
        keep=keep,
    )
    return Extraction(
        folder, urdf, features, tuple(reader.findings), geometry, reader.files,
        links={link.name: link for link in robot.links}, triangles=triangles, opened=opened, companions=companions,
    )  # fmt: skip


def find_textures(robot: "etree._Element", reader: MeshReader) -> list[Finding]:
    """Look up the pictures of a URDF's materials and add them to the reader's files, by reference; a finding for each
    that is not there or lies outside."""
    findings = []
    for reference in dict.fromkeys(str(texture.get("filename")) for texture in textures_of(robot)):
        reader.files[reference], code, problem = reader.find(reference)
        if problem:
            named = reader.refused[reference].reference if reference in reader.refused else reference
            message = f"texture '{named}' {problem}; its material goes without"
            code = "missing_texture" if code == "missing_mesh" else code
            findings.append(warning(Stage.EXTRACT, code, message))
    return findings


def box_center(pose: Array, points: Array) -> Vector3:
    """The centre of the box of a link's (n, 3) points in its own frame, moved by the link's (4, 4) pose, m."""
    return floats_of(apply(pose, (points.min(axis=0, keepdims=True) + points.max(axis=0, keepdims=True)) / 2)[0])


def box_edges(pose: Array, points: Array) -> Vector3:
    """The edges of the box of a link's (n, 3) points along the root's axes, the link at its (4, 4) pose, m; where its
    box in its own frame is tighter (a door drawn ajar), the edges of that, each for the axis that it is nearest to."""
    around, own = np.ptp(apply(pose, points), axis=0), np.ptp(points, axis=0)
    if box_area(own) >= TIGHTER * box_area(around):
        return floats_of(around)
    _, nearest = linear_sum_assignment(-np.abs(pose[:3, :3]))
    return floats_of(own[nearest])


def foot_share(points: Array) -> tuple[float, float] | None:
    """The middle of the lowest of (n, 3) points, z up, in their box seen from above, as shares; None where it is near
    the box's own."""
    low, size = points.min(axis=0), np.maximum(np.ptp(points, axis=0), 1e-12)
    foot = points[points[:, 2] <= low[2] + FOOT_SHARE * size[2], :2]
    x, y = ((foot.min(axis=0) + foot.max(axis=0)) / 2.0 - low[:2]) / size[:2]
    return None if max(abs(x - 0.5), abs(y - 0.5)) < OFF_CENTRE else (round(float(x), 4), round(float(y), 4))


def box_area(edges: Array) -> float:
    """The area of a box with these (3,) edges, m²: unlike its volume, it tells flat ones apart."""
    x, y, z = edges.tolist()
    return float(2.0 * (x * y + y * z + z * x))


def bounds(points: dict[str, Array], poses: dict[str, Array]) -> tuple[Array, Array]:
    """The (3,) minimum and maximum of all links' points at these poses, in the root's frame."""
    together = placed(points, poses)
    return together.min(axis=0), together.max(axis=0)


def placed(points: Mapping[str, Array], poses: Mapping[str, Array]) -> Array:
    """(n, 3) all links' points at these poses, in the root's frame."""
    return np.vstack([apply(poses[name], cloud) for name, cloud in points.items() if len(cloud)])


def standing_edges(points: Array) -> Array:
    """(3,) the edges of the upright box of (n, 3) points, z up: along the axes or, where what it holds stands turned
    among them, so that the smallest box is much smaller, of that, x and y by what they are nearest to."""
    around: Array = np.ptp(points, axis=0)
    turn, size = smallest_rectangle(points[:, :2])
    if np.prod(size) >= TURNED * np.prod(around[:2]):
        return around
    along = size if abs(turn[0, 0]) >= abs(turn[0, 1]) else size[::-1]
    return np.array([*along, around[2]])


def check_spread(urdf: Path, points: Mapping[str, Array], diagonal: float) -> None:
    """Refuse an object that is too small to be one, or whose parts are specks in it: an origin or a unit is wrong.
    ``diagonal`` is that of its box at rest, m. Raises AssetError (unreadable_asset)."""
    largest = max(float(np.linalg.norm(np.ptp(cloud, axis=0))) for cloud in points.values() if len(cloud))
    problem = ""
    if diagonal < SMALLEST_M:
        problem = f"it is {diagonal:.3g} m large: state metres, or the scale of its meshes"
    elif diagonal > MOST_SPREAD * largest > 0.0:
        problem = f"it is {diagonal:.3g} m large, and its largest part {largest:.3g} m: mend the origins of its joints"
        problem += " or the scale of its meshes"
    if problem:
        raise AssetError(FailureMode.UNREADABLE_ASSET, "size_impossible", f"{urdf.name}: {problem}")
