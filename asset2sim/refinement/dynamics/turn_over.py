"""Remedies for what does not stay as it is set down: the whole object turned, to lie as such things lie."""

import math

from scipy.spatial.transform import Rotation

from asset2sim.checks.remedy import Case
from asset2sim.guidance.tables import sizes
from asset2sim.physics.arrays import vector
from schemas.base import Vector3
from schemas.overlay import PhysicsOverlay
from schemas.support import SupportKind

LEAST_TURN_RAD = 1e-3
"""Turn below which an object rests as it is set down, rad."""
TWO_HANDS_M = 0.5
"""Longest edge, m, of what one puts down as it comes to rest, where no table knows it."""
LEANING_RAD = 0.35
"""Turn, rad, up to which an object rests nearly as authored: 20 degrees, as on an uneven underside."""


def lie_down(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """The object written as it comes to rest, where that is near how it is authored, or where such things are put down
    on any side: a pen, a suitcase. A cabinet that topples is not mended by lying."""
    turn = Rotation.from_rotvec(case.rest_turn_rad)
    if turn.magnitude() < LEAST_TURN_RAD or (turn.magnitude() > LEANING_RAD and not lies(case, overlay)):
        return None
    whole = turn * Rotation.from_rotvec(overlay.turned_rad)
    return overlay.model_copy(update={"turned_rad": vector(whole.as_rotvec())})


def lies(case: Case, overlay: PhysicsOverlay) -> bool:
    """Whether such things are put down on whatever side they come to rest: what a hand holds, what the table says, and
    what it does not know and two hands can put down."""
    known = sizes().get(case.features.category)
    if overlay.support.kind is SupportKind.HANDHELD or (known is not None and known.lies):
        return True
    return known is None and overlay.scale * max(case.features.rest_size) <= TWO_HANDS_M


def lie_back(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """The object laid on the side away from which it falls, where such things are put down on any side: a suitcase that
    its open lid pulls over lies on its back."""
    if math.hypot(*case.rest_turn_rad) <= LEANING_RAD or not lies(case, overlay):
        return None
    whole = quarter(case.rest_turn_rad, -1.0) * Rotation.from_rotvec(overlay.turned_rad)
    return overlay.model_copy(update={"turned_rad": vector(whole.as_rotvec())})


def lie_flat_from_leaning(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """The object laid flat on the side to which it was written leaning: a standing suitcase whose lid is slightly open
    tips over before the lid closes."""
    if not LEAST_TURN_RAD < math.hypot(*overlay.turned_rad) <= LEANING_RAD or not lies(case, overlay):
        return None
    return overlay.model_copy(update={"turned_rad": vector(quarter(overlay.turned_rad, 1.0).as_rotvec())})


def quarter(turn_rad: Vector3, way: float) -> Rotation:
    """A quarter turn along a turn (rotation vector, rad; ``way`` 1) or against it (−1)."""
    angle = math.hypot(*turn_rad)
    return Rotation.from_rotvec([way * math.pi / 2.0 * value / angle for value in turn_rad])
