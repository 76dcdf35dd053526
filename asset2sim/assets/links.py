"""One link: its meshes, their union in the link's frame, and its convex pieces."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import trimesh
import yourdfpy

from asset2sim.assets.meshes.hull import hull_area, hull_vertices
from asset2sim.assets.meshes.load import collada_header, primitive, scale_vector
from asset2sim.assets.meshes.paints import link_paints
from asset2sim.assets.meshes.shape_cache import CachedMesh, mesh_key
from asset2sim.assets.meshes.triangles import FAR, Triangles
from asset2sim.assets.meshes.unusable import UnusableMeshError, check_mesh_file, check_size
from asset2sim.assets.meshes.volume import (
    NO_SURFACE,
    Shape,
    SheetSurface,
    Solid,
    combined_solid,
    joined_surfaces,
    shape_of,
)
from asset2sim.assets.solids import PlacedShape, collision_mismatch, left_out, shapes_with_mass
from asset2sim.assets.urdf.references import ANYWHERE, AllowedFolders, Refused, find_mesh, why_missing
from asset2sim.physics.arrays import Array, floats_of, inertia_terms
from asset2sim.physics.convex_hull import hull_volume
from asset2sim.physics.kinematics import TreeJoint, apply, link_to_root
from schemas.errors import AssetError
from schemas.features import LinkFeatures, LinkInertial, MeshFeatures
from schemas.finding import Finding, remark, warning
from schemas.inputs import InputSettings
from schemas.vocabulary import FailureMode, Stage, VolumeSource

HOLE_SHARE = 1e-3
"""Share of a mesh's area that its holes must have to count: slivers that a file's rounding closed up leave less."""


def hole_share(mesh: trimesh.Trimesh) -> float:
    """How far a surface is from closed: the length of its faces' summed area vectors (zero if closed), over its area.
    Holes that face each other cancel out; a single one does not."""
    vectors = np.asarray(mesh.face_normals) * np.asarray(mesh.area_faces)[:, None]
    return float(np.linalg.norm(vectors.sum(axis=0)) / max(float(mesh.area), 1e-300))


@dataclass
class MeshReader:
    """Reader of one asset's meshes: each file is read once; an unreadable one becomes a finding."""

    folder: Path
    triangles: Triangles = field(default_factory=Triangles)
    findings: list[Finding] = field(default_factory=list)
    files: dict[str, Path | None] = field(default_factory=dict)
    shapes: dict[tuple[str, tuple[float, ...]], Shape | None] = field(default_factory=dict)
    holed: set[str] = field(default_factory=set)
    known: Mapping[str, CachedMesh] = field(default_factory=dict)
    """Cached meshes of earlier extractions, by ``mesh_key``."""
    met: dict[str, CachedMesh] = field(default_factory=dict)
    """Meshes of this extraction, by ``mesh_key``."""
    refused: Mapping[str, Refused] = field(default_factory=dict)
    """References that are not read, since they mean files outside."""
    reach: AllowedFolders = ANYWHERE
    origin: Path | None = None
    """The folder of the file that ``folder``'s URDF was made of, in which missing files are looked for in vain."""
    largest_mb: float = InputSettings().max_mesh_mb
    unit_stated: bool = False
    """Whether a mesh file states its unit of length."""
    lost: dict[str, str] = field(default_factory=dict)
    """Reference → why it cannot be read, in words."""

    def note(self, code: str, message: str, link: str) -> None:
        """Add a warning."""
        self.findings.append(warning(Stage.EXTRACT, code, message, link=link))

    def note_collada(self, path: Path, named: str, link: str) -> None:
        """Say once an asset that its COLLADA files are not in metres, or state another up axis than z."""
        unit, axis = collada_header(path)
        told = {finding.code for finding in self.findings}
        self.unit_stated |= unit is not None
        if unit not in (None, 1.0) and "collada_unit" not in told:
            message = f"{named} is in units of {unit:.4g} m; such meshes are brought to metres, as loaders do"
            self.inform("collada_unit", message, link)
        if axis != "Z_UP" and "collada_up_axis" not in told:
            why = "PyBullet, SAPIEN and ROS do; if the object lies, state --up"
            self.inform("collada_up_axis", f"{named} says {axis}; its coordinates are taken as written, as {why}", link)

    def note_mesh(self, found: CachedMesh, named: str, link: str) -> None:
        """Say what is left out of a mesh, and where it is inside out."""
        if found.strays:
            what = f"has {found.strays} triangles over {FAR:g} of its sizes away from all others"
            self.note("stray_triangles", f"{named} {what}; they count for nothing: remove them", link)
        if found.inside_out:
            self.note("inside_out", f"{named} is inside out; collision shapes are wound outwards", link)

    def inform(self, code: str, message: str, link: str) -> None:
        """Add an explanation."""
        self.findings.append(remark(Stage.EXTRACT, code, message, link=link))

    def read(self, path: Path, scale: Array) -> CachedMesh:
        """The mesh of a file at this (3,) scale, from ``known`` if it is there. UnusableMeshError as ``load_mesh``."""
        if path not in self.triangles.keys:
            check_mesh_file(path, self.largest_mb)
        key = mesh_key(self.triangles.key(path), scale)
        found = self.known.get(key) if key is not None else None
        if found is None:
            check_size(self.triangles.of(path)[0], scale)
            mesh = self.triangles.mesh(path, scale)
            closed = bool(mesh.is_watertight)
            found = CachedMesh(
                shape_of(mesh),
                holed=not closed and hole_share(mesh) > HOLE_SHARE,
                inside_out=closed and bool(mesh.volume < 0.0),
                strays=self.triangles.used[path][1],
            )
        if key is not None:
            self.met[key] = found
        return found

    def mesh(self, reference: str, scale: Array) -> trimesh.Trimesh:
        """A mesh that was read before."""
        path = self.files[reference]
        assert path is not None
        return self.triangles.mesh(path, scale)

    def find(self, reference: str) -> tuple[Path | None, str, str]:
        """The file of a reference; None where there is none to be read, with a finding's code and why."""
        if reference in self.refused:
            return None, "outside_dataset", self.refused[reference].problem
        found = find_mesh(reference, self.folder)
        return found, "missing_mesh", "" if found else why_missing(reference, self.origin or self.folder, self.reach)

    def lose(self, reference: str, code: str, problem: str, link: str) -> None:
        """Say that a mesh is left out, and why."""
        self.lost[reference] = problem
        self.note(code, f"{problem}; it is left out", link)

    def shape(self, geometry: yourdfpy.Geometry, link: str) -> tuple[str, Shape | None]:
        """The reference and the shape of one geometry; None, with a finding, where there is nothing to read."""
        if geometry.mesh is None:
            mesh = primitive(geometry)
            return "primitive", None if mesh is None else shape_of(mesh)
        reference = str(geometry.mesh.filename or "")
        named = (
            f"mesh '{self.refused[reference].reference if reference in self.refused else reference}' of link '{link}'"
        )
        if reference not in self.files:
            self.files[reference], code, problem = self.find(reference)
            if problem:
                self.lose(reference, code, f"{named} {problem}", link)
        path = self.files[reference]
        if path is None:
            return reference, None
        scale = scale_vector(geometry.mesh)
        key = (reference, tuple(scale))
        if key not in self.shapes:
            try:
                found = self.read(path, scale)
                self.shapes[key] = found.shape
                if path.suffix.lower() == ".dae":
                    self.note_collada(path, named, link)
                if found.holed:
                    self.holed.add(reference)
                self.note_mesh(found, named, link)
            except UnusableMeshError as error:
                self.lose(reference, "unreadable_mesh", f"{named} {error.problem}", link)
                self.shapes[key] = self.files[reference] = None
        return reference, self.shapes[key]


@dataclass(frozen=True)
class MeshPart:
    """One mesh of a link: its reference and (3,) scale, where it stands in the link's frame, and its convex pieces
    there. ``pieces`` are (k, 3) hull points; a flat mesh has none, and its points are in ``sheet`` instead. ``exact``
    says that the mesh is closed and convex: its hull is its very shape."""

    reference: str
    scale: Array
    rotation: Array
    translation: Array
    pieces: tuple[Array, ...]
    sheet: Array | None
    exact: bool


@dataclass(frozen=True)
class LinkGeometry:
    """(n, 3) hull points of a link, its meshes (primitives: none), and the area of their faces, m², in its frame."""

    points: Array
    parts: tuple[MeshPart, ...]
    drawn_m2: float = 0.0


def read_link(link: yourdfpy.Link, label: str, kind: str, reader: MeshReader) -> tuple[LinkFeatures, LinkGeometry]:
    """One link's features and geometry. The solids are the collision geometry's where there is any that can stand for
    the link, else the visual's. Raises AssetError (missing_mesh) where the link refers to geometry and none of it can
    be read."""
    meshes: list[MeshFeatures] = []
    names: list[str] = []
    placed: dict[str, list[PlacedShape]] = {"visual": [], "collision": []}
    painted: list[tuple[yourdfpy.Visual, Path | None, float]] = []
    wanted = {"visual": 0, "collision": 0}
    for role, items in (("visual", link.visuals), ("collision", link.collisions)):
        for item in items:
            wanted[role] += 1
            file, shape = reader.shape(item.geometry, link.name)
            names.append(file)
            if shape is None:
                continue
            meshes.append(
                MeshFeatures(file=file, role=role, watertight=shape.watertight, flat=shape.flat, n_faces=shape.n_faces)
            )
            if role == "visual":
                painted.append((item, reader.files.get(file), shape.area))
            origin = np.eye(4) if item.origin is None else np.asarray(item.origin, dtype=float)
            mesh = (
                None if item.geometry.mesh is None else (item.geometry.mesh.filename, scale_vector(item.geometry.mesh))
            )
            placed[role].append(PlacedShape(shape, origin[:3, :3], origin[:3, 3], mesh))
    if any(wanted.values()) and not meshes:
        causes = [reader.lost[name] for name in dict.fromkeys(names) if name in reader.lost]
        problem = f"none of its {sum(wanted.values())} meshes can be read; restore its files or remove the link"
        problem += f" ({'; '.join(causes[:3])}{', …' if len(causes) > 3 else ''})" if causes else ""
        raise AssetError(FailureMode.MISSING_MESH, "missing_mesh", f"link '{link.name}': {problem}", link=link.name)
    lost = wanted["collision"] - len(placed["collision"])
    own, doubt = own_shapes(link.name, placed, lost, reader)
    inertial = read_inertial(link.inertial)
    if link.inertial is not None and inertial is None:
        problem = "its inertial lacks a mass or an inertia, or holds a number that is not finite; it counts as none"
        reader.note("inertial_unusable", f"link '{link.name}': {problem}", link.name)
    solids = shapes_with_mass(own)
    body, points = Solid(0.0, np.zeros(3), np.zeros((3, 3))), np.zeros((0, 3))
    walls = NO_SURFACE
    if own:
        walls = wall_surface(own, solids)
        body = combined_solid([item.shape.solid.moved(item.rotation, item.translation) for item in solids])
        points = hull_vertices(np.vstack([item.points(item.shape.points) for item in own]))
    whole, drawn = hull_volume(points), drawn_area(own)
    box = points if own else np.zeros((1, 3))
    sources = {item.shape.source for item in solids} or {VolumeSource.NONE}
    features = LinkFeatures(
        name=link.name,
        label=label,
        joint_kind=kind,
        meshes=tuple(meshes),
        # Pieces overlap in real assets: together they are never more than the link's own hull.
        volume_m3=min(body.volume, whole) if whole > 0.0 else body.volume,
        volume_source=sources.pop() if len(sources) == 1 else VolumeSource.MIXED,
        hull_volume_m3=whole,
        area_m2=sum((item.shape.area for item in own), 0.0),
        outer_m2=outer_area(drawn, points),
        box_min=floats_of(box.min(axis=0)),
        box_max=floats_of(box.max(axis=0)),
        center=floats_of(body.center),
        unit_inertia=inertia_terms(body.inertia / (body.volume if own else 1.0)),
        shell_center=floats_of(walls.center),
        shell_inertia=inertia_terms(walls.inertia / (walls.area or 1.0)),
        materials=link_paints(painted),
        inertial=inertial,
        shapes_doubt=(doubt or "") if wanted["collision"] else "",
    )
    parts = tuple(mesh_part(item, *item.mesh) for item in own if item.mesh is not None)
    return features, LinkGeometry(points, parts, drawn)


def own_shapes(
    link: str, placed: Mapping[str, list[PlacedShape]], lost: int, reader: MeshReader
) -> tuple[list[PlacedShape], str | None]:
    """The shapes that stand for a link: its collision's, with visuals that it leaves out, or its visuals; and why its
    file's collision is not taken as it is, None where it is. ``lost`` of its collision references cannot be read."""
    collision, looks = placed["collision"], placed["visual"]
    doubt = collision_mismatch(collision, looks, lost, reader.holed)
    if doubt is not None:
        message = f"link '{link}': {doubt}; collision shapes are made from its looks instead"
        reader.note("collision_unlike_looks", message, link)
        return looks, doubt
    forgotten = left_out(looks, collision, reader.mesh)
    if forgotten:
        names = ", ".join(f"'{item.mesh[0]}'" for item in forgotten if item.mesh is not None)
        doubt = f"{names} is seen apart from its collision meshes"
        reader.note("collision_unlike_looks", f"link '{link}': {doubt}, and collides, too", link)
    elif any(not item.shape.exact for item in collision):
        doubt = "a mesh of them is not closed and convex: engines would fill its hollow"
    return [*(collision or looks), *forgotten], doubt


def wall_surface(own: list[PlacedShape], solids: list[PlacedShape]) -> SheetSurface:
    """The faces along which a link's wall runs: those of its solids, or of all shapes where sheets are most of it."""
    every, most = (
        joined_surfaces([item.shape.surface.moved(item.rotation, item.translation) for item in items])
        for items in (own, solids)
    )
    return most if most.area >= every.area / 2.0 else every


def drawn_area(items: list[PlacedShape]) -> float:
    """Area of a link's distinct faces, a sheet with both its sides, and of what would close them, m²."""
    return sum(s.area + (s.area if item.shape.flat else s.opening) for item in items for s in (item.shape.surface,))


def outer_area(drawn_m2: float, points: Array) -> float:
    """Area that a body shows to the outside, m²: what is drawn, but at most that of its (n, 3) points' hull, unless it
    is flat as a whole. Walls drawn twice, decals and insides make the faces of real assets up to 8 times the hull's; of
    frames, wires and tubes they are less."""
    return min(drawn_m2, hull_area(points) if hull_volume(points) > 0.0 else math.inf)


def with_shared_walls(
    links: Sequence[LinkFeatures], geometry: Mapping[str, LinkGeometry], tree: Sequence[TreeJoint], root: str
) -> list[LinkFeatures]:
    """The links, those that fixed joints make one body with shares of the area that this shows to the outside, as if
    they were one link: where they lie in or against each other, they have no walls twice."""
    rest, heads, bodies = link_to_root(tree, root, {}), dict[str, str](), dict[str, list[str]]()
    for joint in tree:  # parents first
        if joint.type == "fixed":
            heads[joint.child] = heads.get(joint.parent, joint.parent)
    for name, item in geometry.items():
        if item.drawn_m2 > 0.0:
            bodies.setdefault(heads.get(name, name), []).append(name)
    shown = dict[str, float]()
    for names in bodies.values():
        if len(names) > 1:
            points = np.vstack([apply(rest[name], geometry[name].points) for name in names])
            drawn = sum(geometry[name].drawn_m2 for name in names)
            share = outer_area(drawn, points) / drawn
            shown |= {name: share * geometry[name].drawn_m2 for name in names}
    return [link.model_copy(update={"outer_m2": shown.get(link.name, link.outer_m2)}) for link in links]


def mesh_part(item: PlacedShape, reference: str, scale: Array) -> MeshPart:
    """One placed mesh with its pieces in the link's frame."""
    return MeshPart(
        reference,
        scale,
        item.rotation,
        item.translation,
        tuple(item.points(piece) for piece in item.shape.pieces),
        item.points(item.shape.points) if item.shape.flat else None,
        item.shape.exact,
    )


def read_inertial(inertial: yourdfpy.Inertial | None) -> LinkInertial | None:
    """An authored inertial, its inertia in the link's axes, or None where mass or inertia is not stated or finite."""
    if inertial is None or inertial.mass is None or inertial.inertia is None:
        return None
    origin = np.eye(4) if inertial.origin is None else np.asarray(inertial.origin, dtype=float)
    if not all(np.isfinite(value).all() for value in (origin, inertial.mass, inertial.inertia)):
        return None
    turned = origin[:3, :3] @ np.asarray(inertial.inertia, dtype=float) @ origin[:3, :3].T
    return LinkInertial(
        mass_kg=max(float(inertial.mass), 0.0), com=floats_of(origin[:3, 3]), inertia=inertia_terms(turned)
    )
