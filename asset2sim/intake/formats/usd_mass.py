"""The mass, centre and inertia of a body of a USD stage: as stated, else by UsdPhysics' rules from its shapes."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh

from asset2sim.assets.meshes.volume import Solid, combined_solid, shape_of
from asset2sim.intake.formats.format import pose_of
from asset2sim.intake.formats.usd_shapes import Form
from asset2sim.intake.formats.usd_stage import UsdStage, wxyz
from asset2sim.physics.arrays import Array, inertia_terms
from schemas.base import Inertia6

if TYPE_CHECKING:
    from pxr import Usd

ALIKE = 0.02
"""Relative difference of two masses below which they are one."""
WATER_KG_M3 = 1000.0
"""Density that UsdPhysics gives to a shape without any."""


def capsule(radius: Sequence[float], length: Sequence[float]) -> SimpleNamespace:
    """Volume (m³) and inertia (m⁵, about its middle) of a cylinder along z with half a ball on either end."""
    r, h = radius[0], length[0]
    tube, ball = math.pi * r**2 * h, 4.0 / 3.0 * math.pi * r**3
    across = tube * (3.0 * r**2 + h**2) / 12.0 + ball * (0.4 * r**2 + h**2 / 4.0 + 0.375 * r * h)
    along = tube * r**2 / 2.0 + ball * 0.4 * r**2
    return SimpleNamespace(volume=tube + ball, moment_inertia=np.diag([across, across, along]))


PRIMITIVES: dict[str, Callable[..., Any]] = {
    "box": lambda size: trimesh.primitives.Box(extents=size),
    "sphere": lambda radius: trimesh.primitives.Sphere(radius=radius[0]),
    "cylinder": lambda radius, length: trimesh.primitives.Cylinder(radius=radius[0], height=length[0]),
    "capsule": capsule,
}


@dataclass(frozen=True, eq=False)
class WeighedForm:
    """Geometry in its body's frame, with what is stated for it, 0 where nothing is: its mass (kg), density (kg/m³),
    the density, Coulomb friction and restitution of its physics material."""

    form: Form
    mass_kg: float = 0.0
    density_kg_m3: float = 0.0
    material_kg_m3: float = 0.0
    friction: float = 0.0
    restitution: float = 0.0
    assumed: bool = False
    """Whether its density is the one that MuJoCo's exporter writes for geoms that state none."""

    @classmethod
    def of(cls, stage: UsdStage, prim: "Usd.Prim", form: Form) -> "WeighedForm":
        """Collision geometry with what its prim and its physics material state."""
        from pxr import UsdShade

        unit = stage.kilogram / stage.metre**3
        material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")[0]
        density = friction = bounce = 0.0
        if material:
            density = stage.number(material.GetPrim(), "physics:density") * unit
            friction = stage.number(material.GetPrim(), "physics:dynamicFriction", "physics:staticFriction")
            bounce = stage.number(material.GetPrim(), "physics:restitution")
        mass, own = stage.number(prim, "physics:mass") * stage.kilogram, stage.number(prim, "physics:density") * unit
        exported = "MjcCollisionAPI" in prim.GetPrimTypeInfo().GetAppliedAPISchemas()
        return cls(form, mass, own, density, friction, bounce, exported and own == WATER_KG_M3)

    def solid(self) -> Solid | None:
        """Volume, centre and inertia; None for a sheet, which has none."""
        if self.form.kind == "mesh":
            mesh = trimesh.Trimesh(self.form.vertices, self.form.faces, process=False)
            if not mesh.is_watertight:  # boards drawn apart enclose less than once their common corners are one
                mesh.merge_vertices()
            shape = shape_of(mesh)
            return None if shape.flat else shape.solid
        made = PRIMITIVES[self.form.kind](*self.form.size.values())
        centered = Solid(float(made.volume), np.zeros(3), np.asarray(made.moment_inertia, dtype=float))
        return centered.moved(self.form.pose[:3, :3], self.form.pose[:3, 3])


def mass_of(
    stage: UsdStage, prim: "Usd.Prim", collides: Sequence[WeighedForm], shown: Sequence[Form]
) -> tuple[float, Array, Inertia6] | None:
    """A body's mass (kg), and its inertia about its centre (kg·m²) in the axes of the (4, 4) pose there, by what
    ``collides``, else by what is only ``shown``; None where neither it nor its shapes nor their materials state a mass
    or a density, and where MuJoCo's exporter computed it at a density that nobody stated."""
    forms = collides or [WeighedForm(form) for form in shown]
    mass = stage.number(prim, "physics:mass") * stage.kilogram
    density = stage.number(prim, "physics:density") * stage.kilogram / stage.metre**3
    if not is_stated(stage, prim, mass, density, forms, shown):
        return None
    center, moments = (
        prim.GetAttribute(f"physics:{name}").Get(stage.time) for name in ("centerOfMass", "diagonalInertia")
    )
    turn = prim.GetAttribute("physics:principalAxes").Get(stage.time)
    stated = np.array([*(center or ()), *(moments or ()), *(() if turn is None else wxyz(turn))])
    if np.isnan(stated).any():
        raise stage.refused("usd_number", f"the mass of {prim.GetPath()} has a number that is not finite: mend it")
    whole = None
    if moments is None or not any(moments) or center is None or not np.isfinite(center).all() or mass <= 0.0:
        whole = weighed(forms, density)
        mass = mass if whole is None or mass > 0.0 else whole.volume
    if mass <= 0.0:
        return None
    pose = np.eye(4)
    if center is not None and np.isfinite(center).all():
        pose[:3, 3] = (np.linalg.inv(stage.rigid(prim)) @ stage.world(prim) @ [*center, 1.0])[:3]
    elif whole is not None:
        pose[:3, 3] = whole.center
    if moments is not None and any(moments):
        if turn is not None and any(wxyz(turn)):
            pose[:3, :3] = pose_of(np.zeros(3), wxyz(turn))[:3, :3]
        x, y, z = (float(value) * stage.kilogram * stage.metre**2 for value in moments)
        return mass, pose, (x, 0.0, 0.0, y, 0.0, z)
    stage.notes.append(f"{prim.GetPath()} states no inertia: that of its shapes is taken")
    return mass, pose, inertia_terms(np.zeros((3, 3)) if whole is None else whole.inertia * mass / whole.volume)


def is_stated(
    stage: UsdStage, prim: "Usd.Prim", mass: float, density: float, forms: Sequence[WeighedForm], shown: Sequence[Form]
) -> bool:
    """Whether somebody stated what a body weighs: its mass, its density, or what its shapes have, but not where
    MuJoCo's exporter computed the mass at its default density."""
    if max(mass, density, *(item.mass_kg + item.density_kg_m3 + item.material_kg_m3 for item in forms)) <= 0.0:
        return False
    if not any(item.assumed for item in forms):
        return True
    wholes = [weighed([*forms, *further], 0.0) for further in ([], [WeighedForm(form) for form in shown])]
    if mass and not any(whole and abs(whole.volume - mass) < ALIKE * mass for whole in wholes):
        return True
    said = "is its shapes' at the density of water, MuJoCo's default, and counts as not stated"
    stage.notes.append(f"the mass of {prim.GetPath()} {said}")
    return False


def weighed(forms: Sequence[WeighedForm], density: float) -> Solid | None:
    """All shapes as one solid whose volume is its mass, kg: each shape by its own mass, else its own density, the
    body's, its material's, or water's. None where no shape encloses anything."""
    found = list[Solid]()
    for item in forms:
        solid = item.solid()
        if solid is None or solid.volume <= 0.0:
            continue
        share = item.mass_kg / solid.volume or item.density_kg_m3 or density or item.material_kg_m3 or WATER_KG_M3
        found.append(Solid(solid.volume * share, solid.center, solid.inertia * share))
    return combined_solid(found) if found else None
