"""Geoms of a compiled MJCF as visual and collision shapes of a URDF's links, with their materials, and the links that
it lets pass through each other."""

from collections.abc import Collection, Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.edit import short_numbers
from asset2sim.intake.formats.format import add_child, add_origin, pose_of, write_obj
from asset2sim.physics.arrays import Array

COLOR_OF_ALL = (0.5, 0.5, 0.5, 1.0)
"""Colour of geoms that state none."""
SHOWN_GROUPS = (0, 1, 2)
"""Groups of geoms that MuJoCo's viewer shows; by custom 3 and above are collision shapes."""


class MjcfGeoms:
    """The geoms of one model; meshes are written into ``work``, each once."""

    def __init__(self, mujoco: Any, spec: Any, model: Any, work: Path) -> None:
        self.mj, self.model, self.work = mujoco, model, work
        self.meshes: dict[int, str] = {}
        self.unseen = unseen_geoms(spec, model)

    def add(self, link: Element, geom: int, body_to_link: Array) -> str | None:
        """Write a geom into its link as visual, collision or both; a note where it cannot be. Its pose is in its body,
        whose (4, 4) pose in the link is ``body_to_link``."""
        m = self.model
        kinds, kind = self.mj.mjtGeom, int(m.geom_type[geom])
        pose = body_to_link @ pose_of(m.geom_pos[geom], m.geom_quat[geom])
        a, b, c = (float(value) for value in m.geom_size[geom])
        shape, values = "mesh", {}
        if kind == kinds.mjGEOM_BOX:
            shape, values = "box", {"size": short_numbers([2.0 * a, 2.0 * b, 2.0 * c])}
        elif kind == kinds.mjGEOM_SPHERE:
            shape, values = "sphere", {"radius": short_numbers([a])}
        elif kind == kinds.mjGEOM_CYLINDER:
            shape, values = "cylinder", {"radius": short_numbers([a]), "length": short_numbers([2.0 * b])}
        elif kind == kinds.mjGEOM_MESH:
            values = {"filename": self.mesh_file(int(m.geom_dataid[geom]))}
        elif kind == kinds.mjGEOM_CAPSULE:
            solid = trimesh.creation.capsule(2.0 * b, a)
            values = {"filename": write_obj(self.work, f"geom_{geom}", solid.vertices, solid.faces)}
        elif kind == kinds.mjGEOM_ELLIPSOID:
            solid = trimesh.creation.icosphere(3).apply_scale([a, b, c])
            values = {"filename": write_obj(self.work, f"geom_{geom}", solid.vertices, solid.faces)}
        else:
            return f"geom '{name_of(self.mj, m, 'geom', geom)}' is left out: a URDF has no such shape"
        collides = bool(m.geom_contype[geom] or m.geom_conaffinity[geom])
        seen = not collides or (m.geom_group[geom] in SHOWN_GROUPS and geom not in self.unseen)
        roles = ["visual"] * seen + ["collision"] * collides
        for role in roles:
            element = add_child(link, role)
            add_origin(element, pose)
            add_child(add_child(element, "geometry"), shape, **values)
            if role == "visual":
                name, color = self.paint(geom)
                add_child(add_child(element, "material", name=name), "color", rgba=short_numbers(color))
        return None

    def paint(self, geom: int) -> tuple[str, Array]:
        """The name of a geom's material, with that of its picture, and its colour, times the picture's mean. As in
        MuJoCo's viewer a colour of the geom's own comes first, but for the one that it gives to all."""
        m, material = self.model, int(self.model.geom_matid[geom])
        own = m.geom_rgba[geom]
        if material < 0 or not np.allclose(own, COLOR_OF_ALL):
            name = f"color_{geom}" if material < 0 else f"{name_of(self.mj, m, 'material', material)} {geom}"
            return name, own
        name, color = name_of(self.mj, m, "material", material), np.array(m.mat_rgba[material])
        texture = int(m.mat_texid[material][int(self.mj.mjtTextureRole.mjTEXROLE_RGB)])
        if texture >= 0:
            name += f" {name_of(self.mj, m, 'texture', texture)}"
            start, channels = int(m.tex_adr[texture]), int(m.tex_nchannel[texture])
            count = int(m.tex_height[texture]) * int(m.tex_width[texture]) * channels
            color[:3] *= m.tex_data[start : start + count].reshape(-1, channels)[:, :3].mean(axis=0) / 255.0
        return name, color

    def mesh_file(self, mesh: int) -> str:
        """The file of a compiled mesh, in which its pose is that of its geoms; written once."""
        m = self.model
        if mesh not in self.meshes:
            corners = slice(m.mesh_vertadr[mesh], m.mesh_vertadr[mesh] + m.mesh_vertnum[mesh])
            faces = slice(m.mesh_faceadr[mesh], m.mesh_faceadr[mesh] + m.mesh_facenum[mesh])
            self.meshes[mesh] = write_obj(self.work, f"mesh_{mesh}", m.mesh_vert[corners], m.mesh_face[faces])
        return self.meshes[mesh]


def name_of(mujoco: Any, model: Any, kind: str, index: int) -> str:
    """The name of a body, joint, geom, mesh, material or texture, or one that is made for it."""
    object_type = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
    return str(mujoco.mj_id2name(model, object_type, index) or f"{kind}_{index}")


def unseen_geoms(spec: Any, model: Any) -> frozenset[int]:
    """Geoms of a class named after collision on bodies that have looks of their own: MuJoCo shows them as boxes around
    these, and the benchmarks that write so hide their group."""
    looked = {
        int(model.geom_bodyid[g])
        for g in range(model.ngeom)
        if not (model.geom_contype[g] or model.geom_conaffinity[g])
    }
    named = {
        geom.id for geom in spec.geoms if geom.classname is not None and "collision" in geom.classname.name.lower()
    }
    return frozenset(geom for geom in named if int(model.geom_bodyid[geom]) in looked)


NO_BITS = (0, 0)


def masks_of(model: Any, links: Mapping[int, str], ground: Collection[int]) -> dict[str, tuple[int, int]]:
    """Link → the bits of all its shapes, contype and conaffinity; both 0 where it collides with nothing. ``links``
    names the bodies, ``ground`` the geoms that are no part of an object."""
    found = dict[str, tuple[int, int]]()
    for geom in range(model.ngeom):
        if geom not in ground:
            name = links[int(model.geom_bodyid[geom])]
            kind, reach = found.get(name, NO_BITS)
            found[name] = kind | int(model.geom_contype[geom]), reach | int(model.geom_conaffinity[geom])
    return found


def let_pass(
    mujoco: Any, model: Any, links: Mapping[int, str], masks: Mapping[str, tuple[int, int]]
) -> list[tuple[str, str]]:
    """Pairs of links that the file lets pass through each other, of which engines let a link pass its parent alone: all
    where it switches contacts off; those that it excludes; those whose bits do not meet, if either has any. Of two
    without bits nothing is said: they have no collision shapes, and pass where one is fixed to what the other moves in.
    """
    off = mujoco.mjtDisableBit
    contactless = bool(model.opt.disableflags & (int(off.mjDSBL_CONTACT) | int(off.mjDSBL_CONSTRAINT)))
    excluded = {divmod(int(pair), 1 << 16) for pair in model.exclude_signature}
    found = []
    for first, second in combinations([body for body, name in links.items() if name in masks], 2):
        own, other = masks[links[first]], masks[links[second]]
        apart = not (own[0] & other[1] or other[0] & own[1])
        if own == other == NO_BITS:
            apart = in_one_frame(model, first, second)
        stated = contactless or {(first, second), (second, first)} & excluded
        if (stated or apart) and not are_adjoining(model, first, second):
            found.append((links[first], links[second]))
    return found


def are_adjoining(model: Any, first: int, second: int) -> bool:
    """Whether one of two bodies is the other's parent, or both stand still in the world."""
    parents, welds = model.body_parentid, model.body_weldid
    return bool(parents[first] == second or parents[second] == first or not (welds[first] or welds[second]))


def in_one_frame(model: Any, first: int, second: int) -> bool:
    """Whether one of two bodies is fixed to what the other moves in."""
    welds, parents = model.body_weldid, model.body_parentid
    held = {body: int(welds[parents[welds[body]]]) if welds[body] else -1 for body in (first, second)}
    return bool(held[first] == welds[second] or held[second] == welds[first])
