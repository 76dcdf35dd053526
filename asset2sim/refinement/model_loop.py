"""The paper's loop ("Refine the state"): a model proposes every step of the joint positions until Φ is low enough."""

from collections.abc import Sequence
from dataclasses import dataclass

from asset2sim.engines.contacts import penetration
from asset2sim.models.prompts import MM_PER_M, TriedProposal
from asset2sim.refinement.ask_model import ProposedPose, QuestionContext, propose_pose
from asset2sim.refinement.context import info, warning
from asset2sim.refinement.position_bands import Evaluator, Pose, objective
from asset2sim.refinement.search_state import MOST, Search, focus_joints, pose_grid, poses_along, poses_around, seed_of
from schemas.features import JointFeatures
from schemas.finding import Finding, TraceStep
from schemas.interaction import ContactPair

STAGNATION = 3
"""Refused proposals in a row from which the loop stagnates: the first may be wrong, the next correct it."""


@dataclass(frozen=True)
class ModelWalk:
    """Where a model's steps led: pose, Φ (m), trace, iterations, how they ended, in words, and whether Φ passes."""

    pose: Pose
    phi_m: float
    trace: tuple[TraceStep, ...]
    iterations: int
    ended: str
    good: bool

    @property
    def finding(self) -> Finding:
        """Says after how many iterations the loop ended, at which Φ and why; a warning unless that Φ passes."""
        told = info if self.good else warning
        text = f"the model's loop ended after {self.iterations} iterations at Φ = {MM_PER_M * self.phi_m:.3g} mm"
        return told(code="model_loop", message=f"{text}: {self.ended}", value=self.phi_m)


def refine_by_model(scene: QuestionContext, evaluator: Evaluator) -> ModelWalk:
    """The pose with the lowest Φ to which a model's steps led, within each joint's reach.

    A step is accepted only where Φ falls, and by more than leaving the requested state costs. On stagnation the best
    pose is perturbed, then its focus joints are searched; the loop ends at Φ ≤ ε, where the model approves a state that
    may pass, where it has nothing more to propose, and after ``max_iterations``.
    """
    settings, joints = scene.settings.search, scene.features.joints
    requested = scene.overlay.initial_positions
    start = penetration(evaluator.points(requested))
    seed = seed_of(scene.overlay.asset_id)
    search = Search(joints, scene.reach, evaluator, settings, seed, dict(requested), start)
    search.record("request", search.best, start, 1, True, "the requested state")
    tried: list[TriedProposal] = []
    solved: tuple[tuple[str, str], ...] = ()
    refused, iterations, stuck, ended = 0, 0, None, ""
    while not search.done and iterations < settings.max_iterations:
        pairs = search.pairs()
        focus = colliding_joints(joints, pairs, list(scene.reach))
        iterations += 1
        proposed = ProposedPose(None, "no joint parts the links that overlap", answered=False)
        if focus:
            proposed = propose_pose(scene, scene.overlap(search.best, tried, solved), focus)
        if proposed.pose is not None:
            tried.append(take_if_lower(search, proposed.pose))
            refused = 0 if tried[-1].accepted else refused + 1
        else:
            search.record("model", search.best, search.phi, 0, False, proposed.reason)
            if proposed.approved and search.phi <= scene.settings.thresholds.penetration_m:
                ended = proposed.reason
                break
        if proposed.pose is None or refused >= STAGNATION:
            moved = focus != () and search.best != stuck and unstick(search, focus)
            stuck, refused = search.best, 0
            if moved:
                tried.append(TriedProposal(search.best, search.phi, accepted=True))
            if not proposed.answered or (proposed.pose is None and not moved):
                ended = proposed.reason
                break
        solved = parted_pairs(pairs, search.pairs()) if tried and tried[-1].accepted else ()
    if not ended and search.phi <= settings.target_phi_m:
        ended = "that is as low as wanted"
    elif not ended and search.evaluator.spent:
        ended = f"the {settings.max_evaluations} evaluations of Φ are spent"
    ended = ended or f"the limit of {settings.max_iterations} iterations is reached"
    good = search.phi <= scene.settings.thresholds.penetration_m
    return ModelWalk(search.best, search.phi, tuple(search.log.trace), iterations, ended, good)


def take_if_lower(search: Search, pose: Pose) -> TriedProposal:
    """Evaluate a model's pose, and accept it where Φ falls by more than leaving the requested state costs."""
    phi = search.evaluator.phi(pose)
    lower = phi < search.phi
    worth = objective(phi, pose, search.bands) < objective(search.phi, search.best, search.bands)
    accepted = phi <= search.settings.target_phi_m or (lower and worth)
    if accepted:
        search.record("model", pose, phi, 1, True, "Φ falls")
    else:
        why = "; that is no gain for leaving the requested state" if lower else ""
        reason = f"Φ would be {MM_PER_M * phi:.3g} mm{why}"
        search.record("model", search.best, search.phi, 1, False, reason)
    return TriedProposal(pose, phi, accepted=accepted)


def unstick(search: Search, focus: Sequence[str]) -> bool:
    """Perturb the best pose, then search its focus joints, alone and in pairs, until Φ falls; whether it did."""
    if search.consider("perturbation", poses_around(search.best, focus, search.bands, search.seed)):
        return True
    for name in focus:
        if not search.done and search.consider("line", poses_along(search.best, name, search.bands[name])):
            return True
    return len(focus) > 1 and not search.done and search.consider("grid", pose_grid(search.best, focus, search.bands))


def colliding_joints(
    joints: Sequence[JointFeatures], pairs: Sequence[ContactPair], movable: Sequence[str]
) -> tuple[str, ...]:
    """The few movable joints that part the overlapping pairs, those of the worst pair first."""
    found = (name for pair in pairs for name in focus_joints(joints, [pair], movable))
    return tuple(dict.fromkeys(found))[:MOST]


def parted_pairs(before: Sequence[ContactPair], after: Sequence[ContactPair]) -> tuple[tuple[str, str], ...]:
    """The pairs of links that overlapped before and no longer do."""
    left = {(pair.link_a, pair.link_b) for pair in after}
    return tuple((pair.link_a, pair.link_b) for pair in before if (pair.link_a, pair.link_b) not in left)
