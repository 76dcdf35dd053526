"""Asking a model for a step of the state (paper, "Refine the state"): what it is shown, and how far it may go."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.views import png_bytes, render_views
from asset2sim.models.purposes import REFINEMENT_PURPOSE, model_for
from asset2sim.models.refinement_prompt import Situation, Tried, refinement_request
from asset2sim.search.proposals import Pose
from asset2sim.search.questions import Questions
from asset2sim.search.refine import Ask
from asset2sim.search.state import Band
from schemas.errors import AssetError
from schemas.features import Features
from schemas.measurement import ContactPair
from schemas.model_names import is_prior
from schemas.overlay import PhysicsOverlay
from schemas.request import LabelledImage
from schemas.settings import Settings

MODEL_VIEWS = ("front", "left", "right", "perspective")
"""The four views of the state that a model is shown (paper, "Refine the state")."""


@dataclass(frozen=True)
class Scene:
    """What is the same in every question about one asset: the overlay that asks for the state, the URDF that is
    rendered, how far joints may go (rad or m), and who is asked."""

    features: Features
    overlay: PhysicsOverlay
    settings: Settings
    urdf: Path
    reach: Mapping[str, Band]
    questions: Questions


def model_asker(scene: Scene) -> Ask:
    """What asks the model for a step while parts overlap."""

    def propose(
        best: Pose, phi: float, pairs: tuple[ContactPair, ...], focus: tuple[str, ...], tried: tuple[Tried, ...]
    ) -> Pose | None:
        return next_pose(scene, Situation("overlap", best, phi, pairs, tried=tried), focus)

    return propose


def next_pose(scene: Scene, situation: Situation, focus: tuple[str, ...], shown: Pose | None = None) -> Pose | None:
    """The pose that the model's step leads to, every joint within its reach; None where it has no step, or no more may
    be asked. ``shown`` is the pose that is rendered, where it is not the present one.
    """
    request = refinement_request(
        scene.features,
        scene.overlay,
        situation,
        focus,
        {name: (scene.reach[name].low, scene.reach[name].high) for name in focus},
        pictures(scene, shown or situation.positions),
    )
    step = scene.questions.answer(request, focus)
    if step is None or step.approved:
        return None
    present = situation.positions
    pose = {**present, **{name: scene.reach[name].clamp(present[name] + d) for name, d in step.deltas.items()}}
    return None if pose == present else pose


def pictures(scene: Scene, pose: Pose) -> Sequence[LabelledImage]:
    """Four labelled views of a pose for models that may look; none for one that cannot, or will not be asked."""
    if is_prior(model_for(scene.settings.model, REFINEMENT_PURPOSE)) or scene.questions.left <= 0:
        return ()
    try:
        views = render_views(scene.urdf, pose, scene.settings.views)
    except AssetError:  # nothing to draw: the numbers alone still say what is wrong
        return ()
    return tuple(LabelledImage(label=name, png=png_bytes(views[name])) for name in MODEL_VIEWS)
