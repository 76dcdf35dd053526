"""Parts of a standing object at its floor: those that drag over it, and where it ends the motion of others."""

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply, rigid_links
from asset2sim.physics.mass_matrix import PosedObject
from asset2sim.physics.support_polygon import STANDING_M, standing_on

UP = np.array([0.0, 0.0, 1.0])
TOUCHES_M = 1e-3
"""Height over the floor up to which a part is on it, m: feet sink into engines' planes by up to so much."""
BEARS_M = 0.01
"""How high the rest may hang over the floor for a part to drag, m. Beyond, the part is a foot or a wheel: those of the
carts that were measured reach 15 to 69 mm below the rest, drawers and doors up to 4 mm."""
PLACES = 9
"""Positions over a joint's range at which its part must be on the floor, most of them, for it to drag over it."""


class StandingParts(PosedObject):
    """An object as it stands upright; its points are those that collide."""

    @cached_property
    def lowest(self) -> dict[str, float]:
        """Link → height of its lowest point in the root's frame, m."""
        return {
            link: float((points @ self.poses[link][2, :3]).min() + self.poses[link][2, 3])
            for link, points in self.points.items()
            if len(points) and link in self.poses
        }

    @property
    def floor(self) -> float:
        """Height of the floor in the root's frame, m."""
        return min(self.lowest.values(), default=0.0)

    def moved(self, joint: str) -> tuple[str, ...]:
        """The links that the joint moves as one."""
        return rigid_links(self.tree, joint)

    def heights(self, joint: str, positions: Sequence[float]) -> Array:
        """(k,) height over the floor of the lowest point that the joint moves as one, m, at its k ``positions``;
        infinite where that does not collide."""
        hinge = next(item for item in self.tree if item.name == joint)
        parts = [apply(self.poses[link], self.points[link]) for link in self.moved(joint) if link in self.lowest]
        if not parts:
            return np.full(len(positions), np.inf)
        points, frame = np.vstack(parts), self.poses[hinge.parent] @ hinge.child_to_parent
        axis, ways = frame[:3, :3] @ hinge.axis, np.asarray(positions) - hinge.position(self.positions)
        if hinge.type == "prismatic":
            return np.asarray(points[:, 2].min() + axis[2] * ways - self.floor)
        arms = points - frame[:3, 3]
        along = np.outer(arms @ axis, axis)
        level, across, turned = along[:, 2] + frame[2, 3], (arms - along)[:, 2], np.cross(axis, arms)[:, 2]
        swept = level[:, None] + np.outer(across, np.cos(ways)) + np.outer(turned, np.sin(ways))
        return np.asarray(swept.min(axis=0) - self.floor)

    def floor_without(self, links: Collection[str]) -> float | None:
        """Height over the floor of the lowest point of all other links, m; None where the object does not stand on
        these, or hangs more than ``BEARS_M`` over it."""
        rest = [apply(self.poses[link], self.points[link]) for link in self.lowest if link not in links]
        mass = self.mass
        if not rest or mass <= 0.0:
            return None
        center = sum(item.mass * apply(self.poses[link], item.com[None])[0] for link, item in self.bodies.items())
        support = standing_on(np.vstack(rest), np.asarray(center) / mass, mass, UP)
        raised = support.floor - self.floor
        return raised if support.nearest > 0.0 and raised <= BEARS_M else None

    def carries(self, joint: str) -> bool:
        """Whether the object stands on what the joint moves: most of its mass, or wheels."""
        moved = self.moved(joint)
        wheels = [item for item in self.tree if item.type == "continuous" and item.child in moved]
        if any(self.lowest.get(item.child, np.inf) - self.floor <= BEARS_M for item in wheels):
            return True
        mass = sum(self.bodies[link].mass for link in moved)
        return mass > self.mass / 2.0

    @cached_property
    def on_floor(self) -> tuple[str, ...]:
        """The joints whose parts are on the floor, of those without which the object stands."""
        names = [joint.name for joint in self.tree if joint.type in ("revolute", "prismatic")]
        at = {name: self.positions.get(name, 0.0) for name in names}
        near = [name for name in names if self.heights(name, (at[name],))[0] <= STANDING_M and not self.carries(name)]
        return tuple(name for name in near if self.floor_without(self.moved(name)) is not None)

    def dragging(self, ranges: Mapping[str, tuple[float, float]]) -> tuple[dict[str, tuple[str, ...]], float]:
        """Joint → the links that drag over the floor as it moves through its range (rad or m), and the height of the
        floor, m, on which the object stands without them."""
        found = {}
        for name, ends in ranges.items():
            low = self.heights(name, (self.positions.get(name, 0.0), *np.linspace(*ends, PLACES))) <= TOUCHES_M
            if low[0] and low.mean() > 0.5 and not self.carries(name):
                found[name] = self.moved(name)
        raised = self.floor_without({link for links in found.values() for link in links}) if found else None
        return (found, self.floor + raised) if raised is not None else ({}, self.floor)
