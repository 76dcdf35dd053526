"""Remedies for what does not stay as it is set down: the whole object turned, to lie as such things lie."""

from scipy.spatial.transform import Rotation

from asset2sim.checks.remedy import Case
from asset2sim.physics.arrays import vector
from asset2sim.validation.lying import AS_AUTHORED_RAD, lies
from schemas.overlay import PhysicsOverlay

LEAST_TURN_RAD = 1e-3
"""Turn below which an object rests as it is set down, rad."""


def lie_down(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """The object written as it comes to rest, where that is near how it is authored, or where such things are put down
    on any side: a pen, a suitcase. A cabinet that topples is not mended by lying."""
    turn = Rotation.from_rotvec(case.rest_turn_rad)
    if turn.magnitude() < LEAST_TURN_RAD or (turn.magnitude() > AS_AUTHORED_RAD and not lies(case.features, overlay)):
        return None
    whole = turn * Rotation.from_rotvec(overlay.turned_rad)
    return overlay.model_copy(update={"turned_rad": vector(whole.as_rotvec())})
