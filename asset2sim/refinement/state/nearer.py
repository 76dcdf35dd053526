"""Ask a model for a pose nearer to the requested state, where the search had to leave that state."""

from asset2sim.assets.folder import Folder
from asset2sim.engines.contacts import by_pair
from asset2sim.engines.pybullet_object import contacts_at
from asset2sim.models.refinement_prompt import RefusedProposal, StateProblem
from asset2sim.refinement.ask_model import Scene, next_pose
from asset2sim.refinement.collision.part_links import Attempt, attempt
from asset2sim.refinement.state.bands import distance, joints_outside_state
from asset2sim.refinement.state.context import RefinementContext
from schemas.finding import TraceStep


def nearer_to_request(
    scene: Scene, loop: RefinementContext, folder: Folder, best: Attempt, desired_phi_m: float
) -> Attempt:
    """The attempt, or one at a model's pose that is nearer to the requested state, where Φ is at most its target or no
    higher than before. ``desired_phi_m`` is Φ (m) in the requested state."""
    search = loop.settings.search
    tried: list[RefusedProposal] = []
    for _ in range(search.max_model_calls):
        focus = joints_outside_state(loop.overlay, best.positions, search)
        if not focus:
            break
        pairs = by_pair(contacts_at(folder.urdf, best.positions, loop.settings.engine))
        situation = StateProblem(
            "moved", best.positions, best.phi, pairs, desired_phi_m=desired_phi_m, tried=tuple(tried)
        )
        pose = next_pose(scene, situation, focus)
        if pose is None:
            break
        again = attempt(loop, folder, pose)
        before, after = distance(best.positions, scene.reach), distance(pose, scene.reach)
        nearer = after < (1.0 - search.least_gain) * before
        accepted = nearer and again.phi <= max(search.target_phi_m, best.phi)
        loop.log.step(
            TraceStep(
                step=0,
                proposer="model",
                phi_before_m=best.phi,
                phi_after_m=again.phi if accepted else best.phi,
                moved={name: pose[name] for name in pose if pose[name] != best.positions[name]} if accepted else {},
                accepted=accepted,
                evaluations=1,
                reason="nearer to the requested state"
                if accepted
                else f"Φ would be {1e3 * again.phi:.3g} mm"
                if nearer
                else "no nearer to the requested state",
            )
        )
        if accepted:
            best = again
            tried.clear()
        else:
            tried.append(RefusedProposal(pose, again.phi))
    return best
