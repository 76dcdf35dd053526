"""Who is in the film of a trial: the object, the arm or the pusher, and the bowl, each as triangles that move."""

import tempfile
import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import trimesh

from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.surfaces.load import from_mesh
from asset2sim.assets.surfaces.scene import Scene, load_scene, poses_of
from asset2sim.assets.surfaces.surface import Ints, Paint
from asset2sim.assets.urdf.read import read_urdf
from asset2sim.gym.arm.franka import Arm, franka_tree
from asset2sim.gym.arm.gripper import PANDA, Gripper
from asset2sim.physics.arrays import Array
from asset2sim.render.camera import Singles
from asset2sim.render.faces import Faces, faces_of
from lab.trials.record import Track
from lab.trials.scene import PUSHER_M, Bowl

BOWL_COLOR, PUSHER_COLOR = (0.45, 0.58, 0.72, 1.0), (0.93, 0.55, 0.2, 1.0)
"""RGBA."""


@dataclass(frozen=True, eq=False)
class Actor:
    """Something in the film: its triangles, and (frames, links, 3, 4) transforms from where they were read to the
    world, m."""

    faces: Faces
    motions: Singles


def object_actor(folder: Path, track: Track, chosen: Ints) -> tuple[Actor, Array]:
    """The refined object, as the chosen samples have its links, and the (2,) horizontal direction in which its front
    faces at first."""
    scene = load_scene(folder / URDF_NAME, {})
    faces = faces_of(scene)
    read = poses_of(read_urdf(folder / URDF_NAME), {})
    number = {name: index for index, name in enumerate(track.links)}
    poses = track.poses[chosen]
    motions = [poses[:, number[name]] @ np.linalg.inv(read[name]) for name in faces.links]
    front = (poses[0, 0, :3, :3] @ np.asarray(scene.front))[:2]
    return Actor(faces, np.stack(motions, axis=1)[:, :, :3].astype(np.float32)), front


@cache
def arm_faces(gripper: Gripper = PANDA) -> tuple[Faces, dict[str, Array]]:
    """The arm's triangles at zero, and its links' poses there."""
    with tempfile.TemporaryDirectory(prefix="asset2sim-arm-") as place:
        file = Path(place) / "panda.urdf"
        ET.ElementTree(franka_tree(gripper)).write(file)
        return faces_of(load_scene(file, {})), poses_of(read_urdf(file), {})


def arm_actor(arm: Array, base: Array, gripper: Gripper = PANDA) -> Actor:
    """The arm at (frames, joints) joint positions."""
    faces, read = arm_faces(gripper)
    kinematics = Arm(gripper)
    bodies = [int(kinematics.model.body(name).id) for name in faces.links]
    inverse = np.array([np.linalg.inv(read[name]) for name in faces.links])
    found = []
    for positions in arm:
        kinematics.data.qpos[:] = positions
        mujoco.mj_kinematics(kinematics.model, kinematics.data)
        poses = np.tile(np.eye(4), (len(bodies), 1, 1))
        poses[:, :3, :3] = kinematics.data.xmat[bodies].reshape(-1, 3, 3)
        poses[:, :3, 3] = kinematics.data.xpos[bodies]
        found.append(base @ poses @ inverse)
    return Actor(faces, np.array(found)[:, :, :3].astype(np.float32))


def pusher_actor(at: Array) -> Actor:
    """The bare pusher at (frames, 3) places."""
    surface = replace(from_mesh(trimesh.creation.icosphere(3, PUSHER_M)), paint=Paint(PUSHER_COLOR))
    motions = np.tile(np.eye(4, dtype=np.float32)[:3], (len(at), 1, 1, 1))
    motions[:, 0, :, 3] = at
    return Actor(faces_of(Scene((surface,), ("pusher",), np.array([1.0, 0.0, 0.0]))), motions)


def bowl_actor(bowl: Bowl, frames: int) -> Actor:
    """The bowl, which does not move."""
    profile = [(0.0, 0.0), (bowl.radius_m, 0.0), (bowl.rim_m, bowl.height_m), (bowl.rim_m - 0.006, bowl.height_m),
               (bowl.radius_m - 0.004, 0.006), (0.0, 0.006)]  # fmt: skip
    mesh = trimesh.creation.revolve(np.array(profile), sections=64)
    mesh.apply_translation([*bowl.at, 0.0])
    surface = replace(from_mesh(mesh), paint=Paint(BOWL_COLOR))
    still = np.tile(np.eye(4, dtype=np.float32)[:3], (frames, 1, 1, 1))
    return Actor(faces_of(Scene((surface,), ("bowl",), np.array([1.0, 0.0, 0.0]))), still)
