"""Visual model of the scene: object, arm, bowl, table and room as a MuJoCo model of looks alone, which nothing moves by
itself. Its world is the arm's base: z = 0 is the table's top."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.surfaces.scene import load_scene, poses_of
from asset2sim.assets.surfaces.surface import PLAIN, Paint, Texture
from asset2sim.assets.urdf.read import read_urdf
from asset2sim.gym.arm.franka import HAND
from asset2sim.gym.arm.gripper import PANDA
from asset2sim.gym.world import TOOL
from asset2sim.physics.arrays import Array
from asset2sim.render.faces import Faces, faces_of
from lab.trials.actors import BOWL_COLOR, arm_faces, bowl_actor
from lab.trials.scene import Bowl, TrialScene

TABLE = ((0.7, 0.0, -0.02), (0.55, 0.8, 0.02))
"""Middle and half edges of the table's top, m; the arm stands before it on a bench of its own."""
STAND = ((-0.1, 0.0, -0.38), (0.25, 0.8, 0.38))
FLOOR_M, WALL_M = -0.76, 2.1
"""Height of the room's floor and distance of its wall, m."""
WOOD, STEEL, GREY, CREAM = (0.80, 0.69, 0.55), (0.30, 0.31, 0.33), (0.50, 0.50, 0.51), (0.86, 0.85, 0.82)
LARGEST = 512
"""Edge to which larger textures are reduced, pixels: the cameras see less."""
SHADOWS, SAMPLES = 1024, 4
"""Edge of the map of shadows, and samples a pixel."""
MANY, OBJECT_CELL_M = 5000, 0.001
"""Triangles of a link from which it is thinned out, and to which details of the object, m."""
ARM_CELLS_M = {"": 0.003, "panda_hand": 0.0015, "panda_leftfinger": 0.001, "panda_rightfinger": 0.001}
"""The same of the arm's links: a pixel shows 5 mm from outside, 1 mm at the wrist."""
LIGHT_AT, LIGHT_TO = (0.2, 0.5, 1.8), (0.25, -0.3, -1.0)
"""The lamp above the table: where it hangs, m, and where it shines to."""


def looks_of(folder: Path, stage: TrialScene, width: int, height: int) -> mujoco.MjSpec:
    """A specification of how the stage looks, with the refined object in ``folder``: a mocap body a link, named as the
    stage's bodies are, with room for pictures of this size. Cameras are to be added. Raises AssetError as
    ``load_scene`` does."""
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    spec.visual.quality.shadowsize, spec.visual.quality.offsamples = SHADOWS, SAMPLES
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.38] * 3, [0.22] * 3
    spec.visual.headlight.specular = [0.0] * 3
    spec.visual.map.znear, spec.visual.map.zfar, spec.visual.map.shadowclip = 0.005, 8.0, 1.6
    spec.stat.extent, spec.stat.center = 1.5, (0.5, 0.0, 0.2)
    room(spec)
    file = folder / URDF_NAME
    add_faces(spec, faces_of(load_scene(file, {})), poses_of(read_urdf(file), {}), stage.prefix, {"": OBJECT_CELL_M})
    add_faces(spec, *arm_faces(stage.gripper), TOOL, ARM_CELLS_M, sides=1)
    if stage.gripper is not PANDA:  # then the hand is a frame alone, on which a camera is
        spec.worldbody.add_body(name=TOOL + HAND, mocap=True)
    if stage.bowl is not None:
        add_bowl(spec, stage.bowl)
    return spec


def room(spec: mujoco.MjSpec) -> None:
    """Table, stand, floor, wall and lamp."""
    spec.worldbody.add_light(
        pos=LIGHT_AT, dir=LIGHT_TO, type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, castshadow=True,
        diffuse=(0.55, 0.54, 0.52), ambient=(0.0, 0.0, 0.0), specular=(0.15, 0.15, 0.15),
    )  # fmt: skip
    for name, color, grain in (("wood", WOOD, 10.0), ("steel", STEEL, 0.0), ("grey", GREY, 4.0), ("cream", CREAM, 3.0)):
        painted(spec, name, Paint((*color, 1.0), grained(name, grain)))
    box = mujoco.mjtGeom.mjGEOM_BOX
    spec.worldbody.add_geom(name="table", type=box, pos=TABLE[0], size=TABLE[1], material="wood")
    spec.worldbody.add_geom(name="stand", type=box, pos=STAND[0], size=STAND[1], material="steel")
    for x in (-1, 1):
        for y in (-1, 1):
            at = (TABLE[0][0] + x * (TABLE[1][0] - 0.05), y * (TABLE[1][1] - 0.05), FLOOR_M / 2.0 - 0.02)
            spec.worldbody.add_geom(type=box, pos=at, size=(0.03, 0.03, -FLOOR_M / 2.0 - 0.02), material="steel")
    spec.worldbody.add_geom(type=box, pos=(0.4, 0.0, FLOOR_M - 0.02), size=(3.0, 3.0, 0.02), material="grey")
    for pos, size in (((WALL_M, 0.0, 0.8), (0.02, 3.0, 1.6)), ((0.4, 2.0, 0.8), (3.0, 0.02, 1.6)),
                      ((0.4, -2.0, 0.8), (3.0, 0.02, 1.6)), ((-1.5, 0.0, 0.8), (0.02, 3.0, 1.6))):  # fmt: skip
        spec.worldbody.add_geom(type=box, pos=pos, size=size, material="cream")


def grained(name: str, strength: float) -> Texture | None:
    """A picture of fine streaks about white, with this standard deviation in levels; None for none."""
    if not strength:
        return None
    noise = np.random.default_rng(len(name)).normal(0.0, 1.0, (128, 16))
    streaks = np.repeat(noise, 8, axis=1) * 0.6 + np.random.default_rng(7).normal(0.0, 0.6, (128, 128))
    levels = np.clip(238.0 + strength * streaks, 0.0, 255.0).astype(np.uint8)
    return Texture(f"grain {name}", Image.fromarray(np.repeat(levels.T[:, :, None], 3, axis=2)))


def painted(spec: mujoco.MjSpec, name: str, paint: Paint) -> None:
    """Add a material of this paint."""
    material = spec.add_material(name=name, rgba=paint.color, specular=0.2, shininess=0.3)
    if paint.texture is None:
        return
    if spec.texture(paint.texture.key) is None:
        image = paint.texture.image.convert("RGB")
        image.thumbnail((LARGEST, LARGEST))
        texture = spec.add_texture(
            name=paint.texture.key,
            type=mujoco.mjtTexture.mjTEXTURE_2D,
            width=image.width,
            height=image.height,
            nchannel=3,
        )
        texture.data = image.tobytes()
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = paint.texture.key


def add_faces(
    spec: mujoco.MjSpec, faces: Faces, read: dict[str, Array], prefix: str, cells: Mapping[str, float], sides: int = 2
) -> None:
    """Add a mocap body for each link with its triangles, which were read with the links at these (4, 4) poses, and are
    thinned out to ``cells``: link → edge, m, for links of many triangles, "" for all others."""
    for index, surface in enumerate(faces.surfaces):
        painted(spec, f"{prefix}{index}", surface.paint or Paint(PLAIN))
    for number, link in enumerate(faces.links):
        body = spec.worldbody.add_body(name=prefix + link, mocap=True)
        inverse, mine = np.linalg.inv(read[link]), faces.link == number
        cell = cells.get(link, cells[""]) if mine.sum() > MANY else 0.0
        for index in np.unique(faces.surface[mine]):
            chosen = np.flatnonzero(mine & (faces.surface == index))
            corners = faces.corners[chosen] @ inverse[:3, :3].T + inverse[:3, 3]
            normals = own_normals(faces, chosen) @ inverse[:3, :3].T
            mesh = f"{prefix}{link} {index}"
            if add_mesh(spec, mesh, corners, normals, faces.uv[chosen], cell, sides):
                body.add_geom(
                    type=mujoco.mjtGeom.mjGEOM_MESH,
                    meshname=mesh,
                    material=f"{prefix}{index}",
                    contype=0,
                    conaffinity=0,
                )


def own_normals(faces: Faces, chosen: NDArray[np.signedinteger[Any]]) -> Array:
    """(n, 3, 3) normals at these triangles' corners: the file's own, or the triangle's where it has none or they are
    far from it."""
    flat = np.repeat(faces.flat[chosen][:, None], 3, axis=1)
    own = faces.normals[chosen]
    along = (own * flat).sum(axis=2, keepdims=True)
    own = np.where(along < 0.0, -own, own)
    return np.where(np.abs(along) < 0.2, flat, own)


def add_mesh(
    spec: mujoco.MjSpec, name: str, corners: Array, normals: Array, uv: Array, cell_m: float, sides: int = 2
) -> bool:
    """Add a mesh of (n, 3, 3) triangles, seen from both ``sides`` where files wind their triangles either way. Corners
    in one cell become one, and triangles within it are left out; False if none is left."""
    if cell_m:
        cells = np.rint(corners.reshape(-1, 3) / cell_m).astype(np.int64)
        _, place = np.unique(cells, axis=0, return_inverse=True)
        count = np.bincount(place)
        middles = [np.bincount(place, weights=values) / count for values in corners.reshape(-1, 3).T]
        places = place.reshape(-1, 3)
        ordered = np.sort(places, axis=1)
        wide = (ordered[:, 0] != ordered[:, 1]) & (ordered[:, 1] != ordered[:, 2])
        first = np.unique(ordered, axis=0, return_index=True)[1]
        kept = np.intersect1d(np.flatnonzero(wide), first)
        corners, normals, uv = np.stack(middles, axis=1)[places[kept]], normals[kept], uv[kept]
    if not len(corners):
        return False
    whole = np.concatenate([corners.reshape(-1, 3), np.rint(normals.reshape(-1, 3) * 8.0) / 8.0, uv.reshape(-1, 2)], 1)
    corner, index = np.unique(whole.astype(np.float32), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    corner = np.concatenate([corner, np.repeat(corner[:1], max(0, 4 - len(corner)), axis=0)])  # MuJoCo wants four
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert = np.concatenate([corner[:, :3]] * sides).ravel()
    mesh.usernormal = np.concatenate([corner[:, 3:6], -corner[:, 3:6]][:sides]).ravel()
    above = corner[:, 6:] * [1.0, -1.0] + [0.0, 1.0]  # its pictures begin at the bottom
    mesh.usertexcoord = np.concatenate([above] * sides).ravel()
    mesh.userface = np.concatenate([faces, faces[:, ::-1] + len(corner)][:sides]).ravel()
    return True


def add_bowl(spec: mujoco.MjSpec, bowl: Bowl) -> None:
    """Add the bowl at the middle of a mocap body."""
    faces = bowl_actor(Bowl((0.0, 0.0), bowl.radius_m, bowl.height_m), 1).faces
    painted(spec, "bowl", Paint(BOWL_COLOR))
    body = spec.worldbody.add_body(name="bowl", mocap=True)
    add_mesh(spec, "bowl", faces.corners, own_normals(faces, np.arange(len(faces.corners))), faces.uv, 0.0)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="bowl", material="bowl", contype=0, conaffinity=0)
