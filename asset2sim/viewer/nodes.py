"""The nodes of one object on the page: a frame a link, with looks and overlays below it; the hand."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from asset2sim.physics.arrays import Array
from asset2sim.viewer.handles import WorldContact
from asset2sim.viewer.shapes import Inertial, UrdfShapes

COM_COLOR, BOX_COLOR = (20, 120, 255), (214, 120, 20)
DEEP_COLOR, TOUCH_COLOR, HAND_COLOR = (220, 40, 40), (60, 160, 80), (235, 70, 120)
DEEP_M = 1e-4
"""Depth from which a contact is drawn as an overlap, m."""
STILL = 2e-5
"""Change of a pose below which it is not drawn again, m or a direction's component."""
LABELLED = 5
"""Contacts whose depth is written beside them, the deepest."""
EDGES = ((0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7))
"""Pairs of corners of a box, in ``corners_of_box``' order, that an edge joins."""
CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])

Grabbed = Callable[[str, str, str, Array, Array], None]
"""Called with side, phase (start, update, end), link, the place held and where it is drawn to, in the side's world."""


@dataclass(frozen=True)
class Overlays:
    """Overlays beside the visuals."""

    pieces: bool = False
    centers: bool = False
    boxes: bool = False
    contacts: bool = False

    @property
    def within(self) -> bool:
        """Whether something is shown that the looks would hide."""
        return self.pieces or self.centers or self.boxes or self.contacts


class ObjectNodes:
    """One object on the page, ``scale`` times as large, its world's origin at ``place``; ``shapes`` are so already."""

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        shapes: UrdfShapes,
        poses: Mapping[str, Array],
        grabbed: Grabbed,
        scale: float = 1.0,
    ) -> None:
        self.server, self.name, self.shapes, self.grabbed = server, name, shapes, grabbed
        self.place, self.scale = np.zeros(3), scale
        self.overlays = Overlays()
        self.box = seen_bounds(shapes, poses, scale)
        self.size = float(np.linalg.norm(self.box[1] - self.box[0]))
        self.top = server.scene.add_frame(f"/{name}", show_axes=False)
        self.frames = {
            link: server.scene.add_frame(f"/{name}/{number}", show_axes=False)
            for number, link in enumerate(shapes.links)
        }
        self.looks = self._glbs("looks", shapes.looks)
        self.drawn: dict[str, Array] = {}
        self.inner: dict[str, list[Any]] = {}
        self.labels: list[Any] = []
        scene, hand = server.scene, f"/{name}/hand"
        self.spring = scene.add_line_segments(
            f"{hand}/spring", np.zeros((1, 2, 3)), HAND_COLOR, thickness=4.0, thickness_units="screen", visible=False
        )
        self.grip = scene.add_icosphere(f"{hand}/grip", max(self.size * 0.008, 1e-3), color=HAND_COLOR, visible=False)
        self.force = scene.add_label(f"{hand}/force", "", anchor="bottom-left", visible=False)
        self.move(poses)

    def stand_at(self, place: Array) -> None:
        """Bring the origin of its world to a (3,) place of the page."""
        self.place = np.asarray(place, dtype=float)
        self.top.position = self.place

    def move(self, poses: Mapping[str, Array]) -> None:
        """Draw every link at its (4, 4) pose."""
        for link, frame in self.frames.items():
            # What stays still is not sent again: browsers draw only what changes.
            if link in poses and np.abs(poses[link] - self.drawn.get(link, np.inf)).max() > STILL:
                self.drawn[link] = poses[link]
                x, y, z, w = Rotation.from_matrix(poses[link][:3, :3]).as_quat()
                frame.wxyz, frame.position = (w, x, y, z), self.scale * poses[link][:3, 3]

    def show(self, overlays: Overlays) -> None:
        """Draw these overlays, made when they are first asked for; looks are see-through beside any of them."""
        self.overlays = overlays
        for kind, wanted, make in (
            (
                "ghosts",
                overlays.within and not overlays.pieces,
                lambda: list(self._glbs("ghosts", self.shapes.ghosts).values()),
            ),
            ("pieces", overlays.pieces, lambda: list(self._glbs("pieces", self.shapes.pieces).values())),
            ("centers", overlays.centers, self._centers),
            ("boxes", overlays.boxes, self._boxes),
        ):
            if wanted and kind not in self.inner:
                self.inner[kind] = make()
            for node in self.inner.get(kind, ()):
                node.visible = wanted
        for node in self.looks.values():
            node.visible = not overlays.within
        if not overlays.contacts:
            self.show_contacts([])

    def show_contacts(self, touches: list[WorldContact]) -> None:
        """Draw contact points, overlaps in red, and the depth of the deepest in mm."""
        for label in self.labels:
            label.remove()
        self.labels = []
        if not touches:
            return
        points = self.scale * np.array([touch.place for touch in touches])
        deep = np.array([-touch.separation_m for touch in touches])
        colors = np.where((deep > DEEP_M)[:, None], DEEP_COLOR, TOUCH_COLOR).astype(np.uint8)
        scene, size = self.server.scene, max(self.size * 0.02, 1e-3)
        cloud = scene.add_point_cloud(
            f"/{self.name}/contacts", points, colors, point_size=size, point_shape="circle", precision="float32"
        )
        self.labels = [cloud]
        for number in np.argsort(-deep)[:LABELLED]:
            if deep[number] > DEEP_M:
                text = f"{1000.0 * deep[number]:.2f} mm"
                self.labels.append(
                    scene.add_label(f"/{self.name}/depth{number}", text, position=points[number], anchor="bottom-left")
                )

    def show_hand(self, held: Array | None, target: Array, force_n: float) -> None:
        """Draw the hand's spring from the place held to its other end, and its force; nothing where none is held."""
        for node in (self.spring, self.grip, self.force):
            if node.visible != (held is not None):
                node.visible = held is not None
        if held is not None:
            held, target = self.scale * held, self.scale * target
            self.spring.points = np.array([[held, target]], dtype=np.float32)
            self.grip.position, self.force.position = held, target
            self.force.text = f"{force_n:.1f} N"

    def label(self, text: str) -> None:
        """Write above it."""
        middle = self.box.mean(axis=0)
        place = np.array([middle[0], middle[1], self.box[1, 2] + 0.06 * self.size])
        self.server.scene.add_label(f"/{self.name}/label", text, position=place, anchor="bottom-center")

    def remove(self) -> None:
        """Take it off the page."""
        self.top.remove()

    def _glbs(self, kind: str, parts: Mapping[str, bytes]) -> dict[str, viser.GlbHandle]:
        scene, number = self.server.scene, {link: index for index, link in enumerate(self.shapes.links)}
        made = {link: scene.add_glb(f"/{self.name}/{number[link]}/{kind}", data) for link, data in parts.items()}
        for link, node in made.items():
            self._let_drag(node, link)
        return made

    def _let_drag(self, node: viser.GlbHandle, link: str) -> None:
        # A coroutine, since others are called in no order.
        async def dragged(event: viser.SceneNodeDragEvent[viser.GlbHandle]) -> None:
            held, target = (
                (np.array(place) - self.place) / self.scale for place in (event.start_position, event.end_position)
            )
            self.grabbed(self.name, event.phase, link, held, target)

        node.on_drag("left")(dragged)

    def _centers(self) -> list[Any]:
        heaviest = max((item.mass_kg for item in self.shapes.inertials.values()), default=1.0)
        return [
            self.server.scene.add_icosphere(
                f"{self._link(link)}/com",
                # A volume like the mass, but never too small to be seen.
                self.size * 0.03 * max((item.mass_kg / heaviest) ** (1 / 3), 0.3),
                color=COM_COLOR,
                position=item.center,
            )
            for link, item in self.shapes.inertials.items()
        ]

    def _boxes(self) -> list[Any]:
        return [
            self.server.scene.add_line_segments(
                f"{self._link(link)}/box", box_edges(item), BOX_COLOR, thickness=2.0, thickness_units="screen"
            )
            for link, item in self.shapes.inertials.items()
        ]

    def _link(self, link: str) -> str:
        return f"/{self.name}/{self.shapes.links.index(link)}"


def box_edges(item: Inertial) -> Array:
    """(12, 2, 3) edges of a link's box of inertia, in the link's frame."""
    corners = (CUBE * item.edges) @ item.box_to_link[:3, :3].T + item.box_to_link[:3, 3]
    return np.array([[corners[a], corners[b]] for a, b in EDGES])


def seen_bounds(shapes: UrdfShapes, poses: Mapping[str, Array], scale: float = 1.0) -> Array:
    """(2, 3) lowest and highest corner of what is seen at these poses; a cube of 10 cm where nothing is."""
    corners = [
        points @ poses[link][:3, :3].T + scale * poses[link][:3, 3]
        for link, points in shapes.corners.items()
        if link in poses
    ]
    if not corners:
        return np.array([[-0.05, -0.05, 0.0], [0.05, 0.05, 0.1]])
    every = np.concatenate(corners)
    return np.array([every.min(axis=0), every.max(axis=0)])
