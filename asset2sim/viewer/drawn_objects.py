"""The objects on the page, side by side, and the cameras that look at them."""

import math
from collections.abc import Mapping

import numpy as np
import viser

from asset2sim.physics.kinematics import link_to_root
from asset2sim.viewer.live_object import LiveObject
from asset2sim.viewer.nodes import Grabbed, ObjectNodes, Overlays
from asset2sim.viewer.session import RAW, REFINED, ViewerSession
from asset2sim.viewer.shapes import shapes_of
from asset2sim.viewer.viewed_object import ViewedObject

GAP = 0.35
"""Room between the two objects, as a share of the larger one."""
LOOK_FROM = np.array([-1.0, -0.55, 0.55])
"""Where the camera stands, seen from the object: PartNet-Mobility's objects face -x."""
FOV_RAD = math.radians(40.0)
"""The camera's vertical field of view."""
PORTRAIT = 0.75
"""Width over height of a page below which it is a phone's."""


class DrawnObjects:
    """The objects that are drawn, by name. The raw one stands on the left."""

    def __init__(self, server: viser.ViserServer, grabbed: Grabbed) -> None:
        self.server, self.grabbed = server, grabbed
        self.nodes: dict[str, ObjectNodes] = {}
        self.across = self.height = self.deep = 0.1

    def show(
        self,
        name: str,
        subject: ViewedObject,
        side: LiveObject | None,
        scale: float,
        overlays: Overlays,
        title: str = "",
    ) -> None:
        """Draw one object ``scale`` times as large as it is; in its initial state where it has no ``side`` that moves.
        The ``title`` above it is its name unless stated. Raises AssetError for a URDF that cannot be read."""
        poses = link_to_root(subject.tree, subject.root, subject.start) if side is None else side.poses()
        nodes = ObjectNodes(self.server, name, shapes_of(subject.urdf, scale), poses, self.grabbed, scale)
        title = title or name
        nodes.label(title if abs(scale - 1.0) < 1e-3 else f"{title}, drawn {100.0 * scale:.0f} % as large")
        nodes.show(overlays)
        self.nodes[name] = nodes

    def overlay(self, overlays: Overlays) -> None:
        """Draw these overlays."""
        for nodes in self.nodes.values():
            nodes.show(overlays)

    def move(self, session: ViewerSession) -> None:
        """Draw everything where it is now."""
        for name, side in session.moving().items():
            nodes = self.nodes.get(name)
            if nodes is not None:
                nodes.move(side.poses())
                target = np.zeros(3) if side.grip is None else side.grip.target
                nodes.show_hand(side.held_at(), target, float(np.linalg.norm(side.force)))

    def touch(self, session: ViewerSession) -> None:
        """Draw the contacts where they are asked for."""
        for name, side in session.moving().items():
            nodes = self.nodes.get(name)
            if nodes is not None and nodes.overlays.contacts:
                nodes.show_contacts(side.touches())

    def arrange(self, subjects: Mapping[str, ViewedObject | str]) -> None:
        """Stand the objects beside each other, and look at them."""
        if not self.nodes:
            return
        size = max(nodes.size for nodes in self.nodes.values())
        left = 0.0
        for name in (REFINED, RAW):
            nodes = self.nodes.get(name)
            if nodes is None:
                continue
            low, high = nodes.box
            subject = subjects[name]
            # On a plane the ground is at zero; what is held hangs anywhere.
            floor = low[2] if isinstance(subject, str) or subject.held else min(low[2], 0.0)
            nodes.stand_at(np.array([-(low[0] + high[0]) / 2.0, left - low[1], -floor]))
            left += high[1] - low[1] + GAP * size
        boxes = [nodes.box[1] - nodes.box[0] for nodes in self.nodes.values()]
        self.across = left - GAP * size
        self.deep, _, self.height = (max(box[axis] for box in boxes) for axis in range(3))
        self.server.scene.add_grid(
            "/ground",
            infinite_grid=True,
            cell_size=0.1,
            section_size=1.0,
            fade_distance=6.0 * size,
            # A little lower than the objects stand, or their undersides and the lines would flicker.
            position=(0.0, 0.0, -0.002 * size),
        )
        for client in self.server.get_clients().values():
            self.look(client)

    def look(self, client: viser.ClientHandle) -> None:
        """Turn one browser's camera to the objects."""
        if not self.nodes:
            return
        target = np.array([0.0, self.across / 2.0, self.height / 2.0])
        aspect, slope = client.camera.aspect, math.tan(FOV_RAD / 2.0)
        radius = max(self.height / 2.0 + 0.3 * self.deep, (self.across / 2.0 + 0.3 * self.deep) / aspect)
        away = 1.3 * radius / slope + self.deep / 2.0
        if aspect < PORTRAIT:
            # The controls cover the lower half.
            target[2] -= 0.5 * away * slope
        with client.atomic():
            client.camera.fov = FOV_RAD
            # In this order: a camera that is moved goes on looking the same way.
            client.camera.position = target + away * LOOK_FROM / np.linalg.norm(LOOK_FROM)
            client.camera.look_at = target

    def clear(self) -> None:
        """Take all objects off the page."""
        for nodes in self.nodes.values():
            nodes.remove()
        self.nodes = {}
