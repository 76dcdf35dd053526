"""One object in MuJoCo at poses where nothing moves, where PyBullet is not installed."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.assets.urdf.document import parsed_root
from asset2sim.engines.contacts import LocatedContact
from asset2sim.engines.mujoco_spec import collected_warnings, compiled_model, give_options, object_spec
from asset2sim.engines.mujoco_world import MuJoCoWorld
from asset2sim.physics.arrays import Array

CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
"""(8, 3) signs of a box's corners."""


class StaticMuJoCo(MuJoCoWorld):
    """``StaticObject`` in one MuJoCo model."""

    def located_contacts(self) -> list[LocatedContact]:
        """See ``StaticObject``."""
        points, contact = self.contacts(), self.data.contact
        # MuJoCo's normal leads from its first geom to its second.
        return [
            LocatedContact(point.link_a, point.link_b, point.separation_m, tuple(place), tuple(-frame[:3]))
            for point, place, frame in zip(points, contact.pos.tolist(), contact.frame, strict=True)
        ]

    def boxes(self) -> dict[str, tuple[Array, Array]]:
        """See ``StaticObject``."""
        mujoco.mj_kinematics(self.model, self.data)
        found: dict[str, tuple[Array, Array]] = {}
        for geom, body in enumerate(self.model.geom_bodyid.tolist()):
            middle, half = self.model.geom_aabb[geom].reshape(2, 3)
            corners = (middle + CORNERS * half) @ self.data.geom_xmat[geom].reshape(3, 3).T + self.data.geom_xpos[geom]
            low, high = found.get(name := self.link_names[body - 1], (corners[0], corners[0]))
            found[name] = np.minimum(low, corners.min(axis=0)), np.maximum(high, corners.max(axis=0))
        return found


@contextmanager
def static_mujoco(urdf: Path, timestep_s: float, *, parents: bool = False) -> Iterator[StaticMuJoCo]:
    """The object with its root held and no gravity; ``parents``: a link collides with its parent, too."""
    with collected_warnings() as said:
        # A free root, which stays where it is, keeps the pairs that are excluded by name out of it.
        spec = object_spec(urdf, free=parents, contact_friction=0.0)
        give_options(spec, timestep_s, 0.0)
        if parents:
            spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
        model = compiled_model(spec, urdf)
        world = StaticMuJoCo(model, False, tuple(said), parsed_root(urdf))
        world.place({})
        yield world
