"""SAPIEN's own URDF loader with its default options, on the CPU."""

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree

from asset2sim.assets.folder import URDF_NAME
from asset2sim.engines.sapien_object import import_physx
from asset2sim.physics.arrays import Array
from lab.loaders.loaded import BALL_MASS_KG, BALL_RADIUS_M, Loader, Setting
from schemas.vocabulary import Engine

ACROSS = (0.7071068, 0.0, -0.7071068, 0.0)
"""The turn (wxyz) from PhysX' plane, whose normal is x, to one whose normal is z."""


class PlainSapien:
    """An articulation as the loader leaves it; efforts are ``set_qf``."""

    def __init__(self, scene: Any, articulation: Any, ball: Any) -> None:
        self.scene, self.articulation, self.ball = scene, articulation, ball
        self.timestep_s = float(scene.get_timestep())
        self.names = [joint.name for joint in articulation.active_joints]

    def positions(self) -> dict[str, float]:
        return dict(zip(self.names, (float(v) for v in self.articulation.qpos), strict=True))

    def velocity(self, joint: str) -> float:
        return float(self.articulation.qvel[self.names.index(joint)])

    def place(self, positions: Mapping[str, float], velocities: Mapping[str, float]) -> None:
        self.articulation.set_qpos(np.array([positions.get(name, 0.0) for name in self.names], np.float32))
        self.articulation.set_qvel(np.array([velocities.get(name, 0.0) for name in self.names], np.float32))

    def step(self, efforts: Mapping[str, float]) -> None:
        self.articulation.set_qf(np.array([efforts.get(name, 0.0) for name in self.names], np.float32))
        self.scene.step()

    def root_position(self) -> Array:
        return np.array(self.articulation.root_pose.p, dtype=float)

    def ball_position(self) -> Array:
        return np.array(self.ball.pose.p, dtype=float)


@contextmanager
def open_sapien(folder: Path, setting: Setting) -> Iterator[PlainSapien]:
    """The folder's URDF, without its visuals (the loader makes them on a graphics device), in a scene of its own. What
    other code in this process has set in SAPIEN's globals is set back to its defaults."""
    sapien, physx = import_physx()
    # SAPIEN keeps a scene's configuration in globals of the process.
    config = physx.PhysxSceneConfig()
    config.gravity = setting.gravity
    physx.set_scene_config(config)
    physx.set_body_config(physx.PhysxBodyConfig())
    physx.set_shape_config(physx.PhysxShapeConfig())
    scene = sapien.Scene([physx.PhysxCpuSystem()])
    if setting.timestep_s is not None:
        scene.set_timestep(setting.timestep_s)
    loader = scene.create_urdf_loader()
    if setting.held is not None:
        loader.fix_root_link = setting.held
    with without_visuals(folder / URDF_NAME) as urdf:
        articulation = loader.load(str(urdf))
    if setting.loose:
        for joint in articulation.active_joints:
            joint.friction = 0.0
    articulation.set_root_pose(sapien.Pose([0.0, 0.0, setting.height_m]))
    if setting.floor:
        entity, body = sapien.Entity(), physx.PhysxRigidStaticComponent()
        plane = physx.PhysxCollisionShapePlane(physx.get_default_material())
        plane.local_pose = sapien.Pose(q=ACROSS)
        body.attach(plane)
        entity.add_component(body)
        scene.add_entity(entity)
    ball = None
    if setting.ball is not None:
        builder = scene.create_actor_builder()
        density = BALL_MASS_KG / (4.0 / 3.0 * np.pi * BALL_RADIUS_M**3)
        builder.add_sphere_collision(radius=BALL_RADIUS_M, density=density)
        builder.initial_pose = sapien.Pose(setting.ball)
        ball = builder.build()
    try:
        yield PlainSapien(scene, articulation, ball)
    finally:
        for entity in list(scene.entities):
            scene.remove_entity(entity)


@contextmanager
def without_visuals(urdf: Path) -> Iterator[Path]:
    """A copy of the URDF beside it, without visuals, until the block ends."""
    document = etree.parse(str(urdf))
    for link in document.getroot().findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    with tempfile.NamedTemporaryFile(suffix=".urdf", dir=urdf.parent) as file:
        document.write(file)
        file.flush()
        yield Path(file.name)


LOADERS = (Loader("SAPIEN", Engine.SAPIEN, "scene.create_urdf_loader().load(path)", open_sapien),)
