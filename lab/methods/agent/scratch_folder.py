"""The folder in which an agent tries parameters: they are written there, and simulated in PyBullet."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TypeVar

import numpy as np

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import Folder, write_folder, write_urdf
from asset2sim.baselines.as_proposed import as_proposed
from asset2sim.checks.rest import contacts_at, measure
from asset2sim.engines.child import in_child
from asset2sim.engines.contacts import by_pair
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from asset2sim.render import png_bytes, render_views
from asset2sim.validation.support import with_support
from lab.methods.agent.specs import MIN_TOOL_S, TOOL_LIMIT_S
from schemas.errors import AssetError
from schemas.guidance import NOTHING_ASKED, Guidance
from schemas.interaction import ContactPair, Measurement
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.request import LabelledImage
from schemas.settings import Settings
from schemas.vocabulary import CollisionMode, Engine, Source

T = TypeVar("T")


class ToolError(Exception):
    """Tool failure; the message is returned to the model as the tool's result."""


@dataclass
class ScratchFolder:
    """An agent's folder for one asset, ``path``, and the wall time left for its tools, s."""

    extraction: Extraction
    settings: Settings
    source: Source
    path: Path
    seconds_left: float
    guidance: Guidance = NOTHING_ASKED
    folder: Folder | None = None

    def completed(self, overlay: Overlay) -> PhysicsOverlay:
        """The overlay completed with engine defaults. Raises ToolError where its numbers are impossible."""
        try:
            complete = as_proposed(self.extraction, overlay, self.source, self.settings)
            return with_support(complete, self.extraction, overlay, self.source, self.guidance)
        except (AssetError, ArithmeticError, ValueError) as error:
            raise ToolError(f"these parameters cannot be written: {first_line(error)}") from None

    def written(self, overlay: Overlay) -> tuple[PhysicsOverlay, Path]:
        """Completed parameters, and the URDF written with them, authored collision geometry kept; meshes are copied
        once. Raises ToolError."""
        physics, own = self.completed(overlay), self.settings.physics
        try:
            if self.folder is None:
                self.folder = write_folder(self.extraction, physics, {}, self.path, own, CollisionMode.KEEP)
            else:
                write_urdf(self.extraction, physics, self.folder, own)
        except (AssetError, ArithmeticError, ValueError, OSError) as error:
            raise ToolError(f"these parameters cannot be written: {first_line(error)}") from None
        return physics, self.folder.urdf

    def simulate(self, overlay: Overlay) -> tuple[PhysicsOverlay, Measurement]:
        """Completed parameters, and the measurement at rest with them in PyBullet. Raises ToolError."""
        physics, urdf = self.written(overlay)
        state, friction, own = physics.initial_positions, physics.contact_friction, self.settings.engine
        return physics, self._timed(
            partial(measure, Engine.PYBULLET, urdf, state, friction, own, held=physics.support.fixed)
        )

    def contacts(self, overlay: Overlay) -> tuple[ContactPair, ...]:
        """Link pairs that overlap in the initial state, worst first. Raises ToolError."""
        physics, urdf = self.written(overlay)

        def touching() -> tuple[ContactPair, ...]:
            return by_pair(contacts_at(Engine.PYBULLET, urdf, physics.initial_positions, self.settings.engine))

        return self._timed(touching)

    def pictures(self, overlay: Overlay, views: Sequence[str]) -> tuple[LabelledImage, ...]:
        """Rendered views of the initial state. Raises ToolError."""
        physics, urdf = self.written(overlay)

        def drawn() -> tuple[LabelledImage, ...]:
            images = render_views(urdf, physics.initial_positions, self.settings.views)
            return tuple(LabelledImage(label=name, png=png_bytes(images[name])) for name in views)

        return self._timed(drawn)

    def boxes(self, overlay: Overlay) -> dict[str, tuple[Array, Array]]:
        """Link → the (3,) lowest and highest corner of its shape in the initial state, m in the root link's frame."""
        physics = self.completed(overlay)
        features, scale = self.extraction.features, physics.scale
        tree = tree_of(features.joints, scale)
        poses = link_to_root(tree, features.root, physics.initial_positions)
        points = {name: geometry.points for name, geometry in self.extraction.geometry.items()}
        placed = {name: apply(poses[name], scale * own) for name, own in points.items() if len(own)}
        return {name: (np.min(points, axis=0), np.max(points, axis=0)) for name, points in placed.items()}

    def _timed(self, function: Callable[[], T]) -> T:
        """Result of ``function``, run in a killable child within the tool time left. Raises ToolError."""
        if self.seconds_left < MIN_TOOL_S:
            raise ToolError("the time for tools is spent; finish with what you have")
        start = perf_counter()
        ended = in_child(Engine.PYBULLET, function, time_limit_s=min(TOOL_LIMIT_S, self.seconds_left))
        self.seconds_left -= perf_counter() - start
        if ended.value is None:
            raise ToolError(ended.problem or "it ended without a result")
        return ended.value


def first_line(error: Exception) -> str:
    """An error's type and message in one line."""
    text = " ".join(str(error).split())
    return text if isinstance(error, AssetError) else f"{type(error).__name__}: {text}"
