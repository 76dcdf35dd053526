"""Motion of an object in PyBullet, for the loops: let fall, and its parts let go, as poses at even times."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from lxml import etree

from asset2sim.assets.surfaces.surface import Surface
from asset2sim.assets.urdf.mesh_files import without_materials
from asset2sim.assets.urdf.references import find_mesh
from asset2sim.engines.contacts import penetration
from asset2sim.intake.confine import references
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import pose_of
from asset2sim.render.faces import mixed_hashes
from schemas.settings import EngineSettings

if TYPE_CHECKING:
    from asset2sim.engines.pybullet_world import PyBulletWorld

DROP_TIMES_S = np.concatenate([np.arange(9) / 80.0, 0.1 + np.arange(1, 9) / 8.0])
"""Times of a drop's frames, s: the fall takes 0.064 s, what comes of it one second."""
RELEASE_TIMES_S = np.arange(17) / 8.0
"""Times of a release's frames, s: a door that closes by itself takes two seconds."""
STILL, STILL_FRAMES = 1e-4, 3
"""Change of a pose (m, rad) from frame to frame below which nothing moves, and for how many frames."""
FACE, GROUP = b"\nf ", re.compile(rb"\n[go]\s")
"""What a face of an OBJ begins with, and where PyBullet begins another hull."""
TRIED = 12
"""Joints that are opened half way before they are let go of, at most."""


@dataclass(frozen=True, eq=False)
class LoopMotion:
    """Poses at even times: the root link's (frames, 4, 4) frame in the world, whose floor is z = 0, and (frames,) joint
    positions by name, rad or m. ``finite``: whether every number stayed so; the poses stop where they did not."""

    root: Array
    joints: dict[str, Array]
    finite: bool = True


def let_fall(urdf: Path, positions: Mapping[str, float], friction: float, settings: EngineSettings) -> LoopMotion:
    """The object's fall on a plane from a perturbed start, as in the reset check: as high and as tilted as any of them.
    Raises AssetError (engine_refused) where PyBullet refuses the file."""
    from asset2sim.engines.pybullet_world import open_pybullet

    tilt = settings.reset_rad
    with open_pybullet(urdf, plane=True, timestep_s=settings.timestep_s, contact_friction=friction) as world:
        # What the pose of PyBullet's root is at, the inertial frame, when the root link's own is the world's.
        inertial = pose_of(np.array(world.authored), np.array(world.upright))
        world.place(positions, height_m=settings.reset_m, tilt_rad=(tilt, -tilt, 0.0))
        return poses_at_times(world, inertial, DROP_TIMES_S)


def let_go(
    urdf: Path, positions: Mapping[str, float], speeds: Mapping[str, float], friction: float, settings: EngineSettings
) -> LoopMotion:
    """Its joints let go at these positions and speeds, rad/s or m/s, root held. Raises AssetError as ``let_fall``."""
    from asset2sim.engines.pybullet_world import open_pybullet

    with open_pybullet(urdf, plane=False, timestep_s=settings.timestep_s, contact_friction=friction) as world:
        inertial = pose_of(np.array(world.authored), np.array(world.upright))
        world.place(positions)
        world.kick({name: speed for name, speed in speeds.items() if name in world.joint_names})
        return poses_at_times(world, inertial, RELEASE_TIMES_S)


def as_hulls(urdf: Path, folder: Path, loaded: Mapping[Path, tuple[Surface, ...]]) -> Path:
    """A copy in ``folder`` of a URDF that moves in PyBullet as it does, and is loaded faster: of an OBJ that is
    ``loaded`` PyBullet is given the points alone, of which it makes convex hulls, others name no materials, for it
    decodes the pictures of collision meshes (3.8 s for a knife). The URDF itself where it is not XML. Files that are
    missing stay so."""
    try:
        tree = etree.parse(str(urdf))
    except (etree.XMLSyntaxError, OSError):
        return urdf
    known: dict[str, str] = {}
    for element, reference in references(tree.getroot()):
        file = find_mesh(reference, urdf.parent)
        if file is None:
            continue
        if reference not in known:
            if file.suffix.lower() == ".obj":
                place = folder / f"{len(known)}.obj"
                content = file.read_bytes()
                place.write_bytes(points_of(content, loaded.get(file, ())) or without_materials(content))
            else:
                place = file.resolve()
            known[reference] = str(place)
        element.set("filename", known[reference])
    copy = folder / urdf.name
    tree.write(str(copy), encoding="utf-8")
    return copy


def points_of(content: bytes, surfaces: Sequence[Surface]) -> bytes | None:
    """An OBJ of the points of an OBJ that these surfaces were read of, each once, as triangles of any three. PyBullet
    makes one hull of each ``g`` or ``o`` that has faces, whatever their order or material: None where there are many,
    which trimesh joins."""
    if not surfaces or GROUP.search(content, content.find(FACE), content.rfind(FACE) + 1):
        return None
    vertices = np.concatenate(list({id(surface.vertices): surface.vertices for surface in surfaces}.values()))
    x, y, z = np.ascontiguousarray(vertices.T).view(np.int64)
    points = vertices[np.unique(mixed_hashes(mixed_hashes(mixed_hashes(x) + y) + z), return_index=True)[1]]
    corners = np.resize(np.arange(1, len(points) + 1), 3 * -(-len(points) // 3))
    lines = "v %r %r %r\n" * len(points) % tuple(points.ravel().tolist())
    return (lines + "f %d %d %d\n" * (len(corners) // 3) % tuple(corners.tolist())).encode()


def half_open(
    urdf: Path, start: Mapping[str, float], half: Mapping[str, float], settings: EngineSettings
) -> dict[str, float]:
    """``start`` with these joints half open as far as nothing new overlaps: a rack meets a closed door."""
    from asset2sim.engines.pybullet_world import open_pybullet

    found = dict(start)
    with open_pybullet(
        urdf, plane=False, timestep_s=settings.timestep_s, contact_friction=0.0, gravity_m_s2=0.0
    ) as world:
        world.place(found)
        allowed = penetration(world.contacts()) + 1e-3
        for name, position in list(half.items())[:TRIED]:
            world.place(found | {name: position})
            if penetration(world.contacts()) <= allowed:
                found[name] = position
    return found


def poses_at_times(world: "PyBulletWorld", inertial: Array, times_s: Array) -> LoopMotion:
    """Run the world and read its poses at these times."""
    roots, joints, finite, still = [], [], True, 0
    for count in np.diff(np.rint(times_s / world.timestep_s).astype(int), prepend=0).tolist():
        world.step(count)
        position, orientation = world.root_pose()
        positions = world.positions()
        finite = all(np.isfinite(array).all() for array in (position, orientation, positions))
        if not finite:
            break
        roots.append(pose_of(position, orientation) @ np.linalg.inv(inertial))
        joints.append(positions)
        moved = max(np.ptp(states[-2:], axis=0).max(initial=0.0) for states in (roots, joints))
        still = still + 1 if len(roots) > 1 and moved < STILL else 0
        if still == STILL_FRAMES:
            break
    missing = len(times_s) - len(roots)
    roots, joints = roots + roots[-1:] * missing, joints + joints[-1:] * missing
    table = np.array(joints).reshape(len(times_s), -1)
    return LoopMotion(np.array(roots), dict(zip(world.joint_names, table.T, strict=True)), finite)
