"""USD export beside the URDF: UsdPhysics bodies and joints, with attributes for PhysX, Newton and MuJoCo.

Written with ``usd-core`` itself, because no converter keeps the dynamics (each tried on a refined box with two lids):

- ``urdf-usd-converter`` 0.3.4 keeps mass, inertia, convex hulls, limits, and damping and friction in Newton's names;
  it loses springs, the initial state and contact friction, writes no drive and nothing that PhysX reads, fixes the root
  to the world, left out one of four visual meshes (texture indices out of range), and brings an OpenUSD build of its
  own that cannot be imported beside ``usd-core``.
- ``mujoco-usd-converter`` 0.8.0 also keeps springs, in MuJoCo's names; it loses the keyframe ("keys are not
  supported"), writes no drive, and pins MuJoCo below 3.17, where we run 4.
- ``newton`` 1.8.0 reads USD and writes none.

Units: metres, kilograms, seconds; angles in degrees, and so angular stiffness in N·m/deg and damping in N·m·s/deg.

Hulls that are larger than PhysX takes to a GPU are made smaller here, and only here (``usd_hulls``); each says so in
its custom data, and the root layer sums them up in its own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from asset2sim.assets import mujoco_options
from asset2sim.assets.exports.refined_object import USD_NAME, ExportBody, ExportObject, read_object, wxyz_of
from asset2sim.assets.exports.usd_collision import (
    CUSTOM_DATA,
    LimitedHull,
    hull_data,
    make_collidable,
    set_transform,
    write_contact,
    write_shape,
)
from asset2sim.assets.exports.usd_joints import set_unregistered, write_joints
from asset2sim.assets.exports.usd_looks import PrimPaths, write_looks
from asset2sim.assets.exports.visuals import looks_of
from asset2sim.physics.arrays import Array
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings

GEOMETRY_NAME = "mobility_geometry.usdc"
"""The layer that holds the points: binary, so that the other one stays short enough to read."""


@dataclass(frozen=True)
class UsdExport:
    """A written export: its root layer, and the collision hulls that were made smaller in it."""

    path: Path
    limited: tuple[LimitedHull, ...]

    @property
    def distance_m(self) -> float:
        """The largest distance, m, of a given hull from the one in its place; 0 where none is replaced."""
        return max((hull.distance_m for hull in self.limited), default=0.0)

    @property
    def volume_ratio(self) -> float:
        """The least share of a given hull's volume that the one in its place has; 1 where none is replaced."""
        return min((hull.volume_ratio for hull in self.limited), default=1.0)


def export_usd(folder: Path, overlay: PhysicsOverlay, timestep_s: float = EngineSettings().timestep_s) -> UsdExport:
    """Write ``mobility.usda`` and ``mobility_geometry.usdc`` into a refined folder. The default prim is the object, z
    up, in its initial state, its lowest collision point at z = 0; MuJoCo's constraints are those of the checks at
    ``timestep_s``. Raises what ``read_object`` raises."""
    item = read_object(folder, overlay)
    path, geometry_path = folder / USD_NAME, folder / GEOMETRY_NAME
    for old in (path, geometry_path):
        old.unlink(missing_ok=True)
    geometry = Sdf.Layer.CreateAnonymous(".usdc")
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().subLayerPaths.append(geometry.identifier)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    names = PrimPaths(item)
    top = UsdGeom.Xform.Define(stage, names.top)
    stage.SetDefaultPrim(top.GetPrim())
    material = write_material(stage, item, f"{names.top}/contact")
    poses = item.poses(item.initial)
    lift = np.eye(4)
    lift[2, 3] = item.height_to_stand(item.initial)
    limited: list[LimitedHull] = []
    for body in item.bodies.values():
        prim = write_body(stage, body, lift @ poses[body.name], names.links[body.name])
        prim.SetDisplayName(body.name)
        if body.name == item.root and not item.fixed:
            write_articulation(prim)
        for index, shape in enumerate(body.shapes):
            at = f"{names.links[body.name]}/collision_{index}"
            with Usd.EditContext(stage, geometry):
                smaller = write_shape(stage, shape, item.folder, at)
                write_contact(stage.GetPrimAtPath(at), shape, item.rolling_friction_m, timestep_s)
            make_collidable(stage.GetPrimAtPath(at), shape, material)
            if smaller is not None:
                limited.append(smaller)
                stage.GetPrimAtPath(at).SetCustomDataByKey(CUSTOM_DATA, hull_data(smaller))
    filter_pairs(stage, item.passing, names.links)
    write_joints(stage, item, names, timestep_s)
    if item.fixed:
        write_articulation(hold_root(stage, lift @ poses[item.root], names.links[item.root], names.base))
    with Usd.EditContext(stage, geometry):
        write_looks(stage, looks_of(item), item.folder, names)
    geometry.Export(str(geometry_path))
    # A copy, for a layer on a stage would look for its new sublayer at once, and not in the folder.
    root = Sdf.Layer.CreateAnonymous(".usda")
    root.TransferContent(stage.GetRootLayer())
    root.subLayerPaths[:] = [f"./{GEOMETRY_NAME}"]
    export = UsdExport(path, tuple(limited))
    root.customLayerData = {CUSTOM_DATA: summary_data(export)}
    root.Export(str(path))
    return export


def summary_data(export: UsdExport) -> dict[str, float | int]:
    """Custom data of the root layer on all hulls that were made smaller."""
    return {
        "hulls_limited": len(export.limited),
        "largest_distance_m": round(export.distance_m, 9),
        "least_volume_ratio": round(export.volume_ratio, 6),
    }


def hold_root(stage: Usd.Stage, to_object: Array, link: str, path: str) -> Usd.Prim:
    """A fixed joint at ``path`` that holds the root link to the world where it is written, ``to_object`` being its
    (4, 4) place in the object's prim, with which it moves when that is placed."""
    joint = UsdPhysics.FixedJoint.Define(stage, path)
    # Without a first body the frame is the world's; the object's prim, which is no body, is taken as where it stands.
    joint.CreateBody0Rel().SetTargets([stage.GetDefaultPrim().GetPath()])
    joint.CreateBody1Rel().SetTargets([link])
    joint.CreateLocalPos0Attr(Gf.Vec3f(*(float(v) for v in to_object[:3, 3])))
    joint.CreateLocalRot0Attr(Gf.Quatf(*wxyz_of(to_object[:3, :3])))
    joint.CreateLocalPos1Attr(Gf.Vec3f(0.0))
    joint.CreateLocalRot1Attr(Gf.Quatf(1.0))
    return joint.GetPrim()


def filter_pairs(stage: Usd.Stage, pairs: Sequence[tuple[str, ...]], links: Mapping[str, str]) -> None:
    """Have pairs of links, by their prims' paths, pass through each other."""
    for first in dict.fromkeys(pair[0] for pair in pairs):
        api = UsdPhysics.FilteredPairsAPI.Apply(stage.GetPrimAtPath(links[first]))
        api.CreateFilteredPairsRel().SetTargets([links[second] for other, second in pairs if other == first])


def write_articulation(prim: Usd.Prim) -> None:
    """Mark the object as one articulation with this root body, or this joint that holds it to the world, whose links
    collide with each other, except parent and child. On the object's prim, readers would choose a root by themselves:
    another link, with joints turned round."""
    UsdPhysics.ArticulationRootAPI.Apply(prim)
    prim.AddAppliedSchema("PhysxArticulationAPI")
    set_unregistered(prim, "physxArticulation:enabledSelfCollisions", True)


def write_material(stage: Usd.Stage, item: ExportObject, path: str) -> str:
    """The material of every contact: Coulomb friction, resistance to spinning and rolling (m), no bounce. Its path."""
    material = UsdShade.Material.Define(stage, path)
    prim = material.GetPrim()
    api = UsdPhysics.MaterialAPI.Apply(prim)
    api.CreateStaticFrictionAttr(item.contact_friction)
    api.CreateDynamicFrictionAttr(item.contact_friction)
    api.CreateRestitutionAttr(0.0)
    spinning, rolling = mujoco_options.TORSION_M, item.rolling_friction_m or mujoco_options.ROLLING_M
    for schema, names in (
        ("NewtonMaterialAPI", ("newton:torsionalFriction", "newton:rollingFriction")),
        ("MjcMaterialAPI", ("mjc:torsionalfriction", "mjc:rollingfriction")),
    ):
        prim.AddAppliedSchema(schema)
        for name, value in zip(names, (spinning, rolling), strict=True):
            set_unregistered(prim, name, value)
    return path


def write_body(stage: Usd.Stage, body: ExportBody, to_world: Array, path: str) -> Usd.Prim:
    """One rigid body at its place in the initial state, with its mass, and its inertia by its principal axes."""
    xform = UsdGeom.Xform.Define(stage, path)
    set_transform(xform, to_world)
    prim = xform.GetPrim()
    UsdPhysics.RigidBodyAPI.Apply(prim)
    prim.AddAppliedSchema("PhysxRigidBodyAPI")
    for name in ("linearDamping", "angularDamping"):
        # PhysX adds drag to bodies by default; only the joints' damping is wanted.
        set_unregistered(prim, f"physxRigidBody:{name}", 0.0)
    moments, axes = np.linalg.eigh(body.inertia)
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] *= -1.0
    w, x, y, z = wxyz_of(axes)
    mass = UsdPhysics.MassAPI.Apply(prim)
    mass.CreateMassAttr(body.mass_kg)
    mass.CreateCenterOfMassAttr(Gf.Vec3f(*(float(v) for v in body.com)))
    mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*(float(v) for v in moments)))
    mass.CreatePrincipalAxesAttr(Gf.Quatf(w, x, y, z))
    return prim
