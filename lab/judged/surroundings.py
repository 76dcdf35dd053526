"""Things of known size beside what is rated, so that a rater can judge its size: a drink can and a person."""

import trimesh
import viser

from asset2sim.viewer.drawn_objects import DrawnObjects

CAN_M = (0.033, 0.12)
"""Radius and height of a drink can of a third of a litre, m."""
PERSON_M = 1.75
"""Height of the person, m."""
PERSON_WIDTH_M = 0.5
CAN_COLOR, PERSON_COLOR = (200, 60, 50), (205, 212, 222)
BEHIND_M = 0.4
"""Room between an object and the person behind it, m."""
NEAR = 0.25
"""Room between an object and the can, as a share of the object's size; at least ``LEAST_M``."""
LEAST_M = 0.06


def can() -> trimesh.Trimesh:
    """A drink can that stands on the ground."""
    radius, height = CAN_M
    return _standing(radius, 0.0, height)


def person() -> trimesh.Trimesh:
    """A figure of ``PERSON_M`` that stands on the ground and faces -x."""
    parts = [_standing(0.07, 0.0, 0.85, y=side) for side in (-0.1, 0.1)]
    parts += [_standing(0.05, 0.8, 0.62, y=side) for side in (-0.24, 0.24)]
    parts += [trimesh.creation.box(bounds=[[-0.13, 0.03 + side, 0.0], [0.06, 0.17 + side, 0.07]]) for side in (-0.2, 0)]
    parts += [trimesh.creation.box(bounds=[[-0.1, -0.2, 0.82], [0.1, 0.2, 1.45]]), _standing(0.06, 1.43, 0.12)]
    head = trimesh.creation.icosphere(subdivisions=3, radius=0.125)
    head.apply_translation([0.0, 0.0, PERSON_M - 0.125])
    whole: trimesh.Trimesh = trimesh.Scene([*parts, head]).to_mesh()
    return whole


class Surroundings:
    """The can and the person on one page; ``stand`` puts them beside what the stage shows."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.can, self.person = (
            server.scene.add_mesh_simple(
                f"/beside/{name}", made.vertices, made.faces, color=color, cast_shadow=False, visible=False
            )
            for name, made, color in (("can", can(), CAN_COLOR), ("person", person(), PERSON_COLOR))
        )

    def hide(self) -> None:
        """Take them off the page."""
        self.can.visible = self.person.visible = False

    def stand(self, stage: DrawnObjects) -> None:
        """Stand them on the left of the objects, and look at these and the can."""
        gap = max(NEAR * max(stage.across, stage.deep), LEAST_M)
        left = stage.across + gap + CAN_M[0]
        self.can.visible = self.person.visible = True
        self.can.position = (0.0, left, 0.0)
        self.person.position = (0.5 * stage.deep + BEHIND_M, left + CAN_M[0] + LEAST_M + PERSON_WIDTH_M / 2.0, 0.0)
        stage.across = left + CAN_M[0]
        stage.height = max(stage.height, CAN_M[1])
        for client in stage.server.get_clients().values():
            stage.look(client)


def _standing(radius: float, bottom: float, height: float, y: float = 0.0) -> trimesh.Trimesh:
    made: trimesh.Trimesh = trimesh.creation.cylinder(radius=radius, height=height, sections=32)
    made.apply_translation([0.0, y, bottom + height / 2.0])
    return made
