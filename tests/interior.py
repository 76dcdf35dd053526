"""Containment check: whether a ball placed in a link's authored interior stays there in simulation.

The interior is found in the visual meshes; the ball meets the collision shapes. Where these fill the hollow, the ball
starts inside them; where they lack a wall, it falls through.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pybullet

from asset2sim.assets.meshes.interior import interiors as compartments
from asset2sim.assets.meshes.load import load_mesh, primitive, scale_vector
from asset2sim.assets.urdf.read import read_urdf
from asset2sim.assets.urdf.references import find_mesh
from asset2sim.engines.pybullet_object import loaded
from asset2sim.intake.locate import find_source
from asset2sim.intake.origin import extract
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from schemas.asset import AssetRef

BALL_RADIUS_M = 0.01
"""Radius of the ball, m: 2 cm across, a marble."""
BALL_MASS_KG = 0.01
"""Mass of the ball, kg: 2.4 g/cm³, glass."""
OVERLAP_M = 1e-3
"""How deep the ball may start in a collision shape, m: PyBullet's margin around meshes."""
FALL_S = 2.0
"""Simulated time, s: the ball falls 1 m in about 0.5 s."""
TIMESTEP_S = 1.0 / 240.0
"""PyBullet's default time step, s: at 1 m/s the 20 mm ball moves 4 mm a step and cannot pass through a sheet."""
HOLDING_FORCE = 1e3
"""Motor force or torque that holds the joints in position, N or N·m."""


@dataclass(frozen=True)
class Interior:
    """Result for one link: ball position (root frame, m), initial overlap with a collision shape, whether it stayed."""

    link: str
    label: str
    point: tuple[float, float, float]
    overlap_m: float
    stayed: bool

    @property
    def holds(self) -> bool:
        """Whether the ball started free and stayed within the link."""
        return self.stayed and self.overlap_m <= OVERLAP_M


def interiors(folder: Path, labels: Sequence[str] = (), radius: float = BALL_RADIUS_M) -> tuple[Interior, ...]:
    """Containment of a ball in every link of a refined folder that has an interior, all joints at their closed ends.

    ``labels`` keeps only links whose label contains one of these words. Links without an interior are left out.
    """
    urdf = find_source(folder)
    extraction = extract(AssetRef(asset_id=folder.name, path=str(folder)))
    features = extraction.features
    closed = {joint.name: joint.closed for joint in features.movable_joints if joint.closed is not None}
    poses = link_to_root(tree_of(features.joints), features.root, closed)
    seen = {
        link: apply(poses[link], faces.reshape(-1, 3)).reshape(-1, 3, 3) for link, faces in visual_faces(urdf).items()
    }
    found = []
    for link in features.links:
        if link.name not in seen or (labels and not any(word in link.label for word in labels)):
            continue
        others = [faces for name, faces in seen.items() if name != link.name]
        point = cavity(seen[link.name], np.vstack(others) if others else np.zeros((0, 3, 3)), radius)
        if point is not None:
            box = (seen[link.name].reshape(-1, 3).min(axis=0), seen[link.name].reshape(-1, 3).max(axis=0))
            overlap, stayed = dropped(urdf, closed, point, box, radius)
            found.append(Interior(link.name, link.label, (point[0], point[1], point[2]), overlap, stayed))
    return tuple(found)


def cavity(own: Array, others: Array, radius: float) -> Array | None:
    """The (3,) point of a link's interior that is furthest from all faces, or None where no ball fits into one."""
    found = compartments(own, others, radius)
    return found[0].points[int(found[0].clearance_m.argmax())] if found else None


def dropped(
    urdf: Path, positions: Mapping[str, float], point: Array, box: tuple[Array, Array], radius: float
) -> tuple[float, bool]:
    """How deep (m) a ball at ``point`` starts in a collision shape, and whether it ends within ``box`` (root frame)."""
    with loaded(urdf, fixed_base=True, timestep_s=TIMESTEP_S) as item:
        client = item.client
        item.place(positions)
        for name, index in item.joint_index.items():
            client.setJointMotorControl2(
                item.body,
                index,
                pybullet.POSITION_CONTROL,
                targetPosition=positions.get(name, 0.0),
                force=HOLDING_FORCE,
            )
        # The root's frame is the body's inertial frame moved back: contacts and the ball are in the world's.
        inertial = client.getDynamicsInfo(item.body, -1)
        place, turn = client.getBasePositionAndOrientation(item.body)
        back = client.invertTransform(inertial[3], inertial[4])
        root = client.multiplyTransforms(place, turn, *back)
        ball = client.createMultiBody(
            BALL_MASS_KG,
            client.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius),
            basePosition=client.multiplyTransforms(*root, point.tolist(), (0.0, 0.0, 0.0, 1.0))[0],
        )
        near = client.getClosestPoints(ball, item.body, 0.0)
        overlap = max((-float(contact[8]) for contact in near), default=0.0)
        for _ in range(round(FALL_S / TIMESTEP_S)):
            client.stepSimulation()
        ended = client.getBasePositionAndOrientation(ball)[0]
        local = np.array(client.multiplyTransforms(*client.invertTransform(*root), ended, (0.0, 0.0, 0.0, 1.0))[0])
    stayed = bool((local >= box[0] - radius).all() and (local <= box[1] + radius).all())
    return max(overlap, 0.0), stayed


def visual_faces(urdf: Path) -> dict[str, Array]:
    """Link → (k, 3, 3) faces of its visuals in its frame; links without visuals are left out."""
    found: dict[str, Array] = {}
    for link in read_urdf(urdf).links:
        faces = []
        for item in link.visuals:
            mesh = primitive(item.geometry)
            if item.geometry.mesh is not None:
                file = find_mesh(item.geometry.mesh.filename, urdf.parent)
                if file is None:
                    continue
                mesh = load_mesh(file)
                mesh.apply_scale(scale_vector(item.geometry.mesh))
            if mesh is not None:
                origin = np.eye(4) if item.origin is None else np.asarray(item.origin, dtype=float)
                faces.append(apply(origin, np.asarray(mesh.vertices, dtype=float))[np.asarray(mesh.faces)])
        if faces:
            found[link.name] = np.vstack(faces)
    return found
