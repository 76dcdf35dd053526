"""Remedies for failing checks: pure functions from an overlay to a changed one, or None where nothing changes.

A remedy changes little and stays within the bounds of validation: damping within the stability limit of the time
step, inertia only upwards, no friction added to a joint with a spring.
"""

from collections.abc import Callable
from functools import partial

from scipy.spatial.transform import Rotation

from asset2sim.checks.declared_check import Case, Remedy, check_of
from asset2sim.physics.arrays import floats_of
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from asset2sim.validation.lying import AS_AUTHORED_RAD, is_laid_down
from schemas.overlay import JointPhysics, LinkPhysics, PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Source

ROLLING_M, MOST_ROLLING_M = 5e-4, 2e-3
"""Rolling resistance that stops rocking, m: a hard object's on wood, doubled up to one's on rubber or felt."""
HOLD_FRICTION_FACTOR = 1.5
"""Factor on the friction of a joint that slips, per step."""
LOOSENING_FACTOR = 0.3
"""Factor on the friction or damping of a joint that sticks, per step."""
LOOSER_FACTOR = 0.6
"""Factor on the friction of a joint that a hand cannot move, per step."""
UP = 2
"""Index of the vertical among the axes of the root's frame."""
LEAST_TURN_RAD = 1e-3
"""Turn below which an object rests as it is set down, rad."""


def with_joints(
    case: Case, overlay: PhysicsOverlay, change: Callable[[JointPhysics], dict[str, object]]
) -> PhysicsOverlay | None:
    """The overlay with ``change`` applied to the joints of the case; None where nothing changes."""
    joints = tuple(joint.model_copy(update=change(joint)) if case.about(joint) else joint for joint in overlay.joints)
    return None if joints == overlay.joints else overlay.model_copy(update={"joints": joints})


def set_by_search(term: str, value: float) -> dict[str, object]:
    """Update of a joint: this term, set by the search."""
    return {term: value, f"{term}_source": Source.SEARCH}


def least_inertia(joint: JointPhysics) -> float:
    """Least effective inertia over a joint's range, kg·m² or kg; that at the initial position where it is unknown."""
    return joint.least_inertia or joint.effective_inertia


def largest_damping(case: Case, joint: JointPhysics) -> float:
    """Largest damping that is stable at the coarse time step, N·m·s/rad or N·s/m."""
    physics = case.settings.physics
    return physics.max_damping_step * least_inertia(joint) / physics.coarse_timestep_s


def more_damping(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Damping times ``mend_factor``, within the time step's bound (the paper: ×2 to ×5 on persistent oscillation)."""

    def change(joint: JointPhysics) -> dict[str, object]:
        damping = min(case.settings.search.mend_factor * joint.damping, largest_damping(case, joint))
        return set_by_search("damping", damping) if damping > 1.001 * joint.damping else {}

    return with_joints(case, overlay, change)


def less_damping(case: Case, overlay: PhysicsOverlay, factor: float = 0.5) -> PhysicsOverlay | None:
    """Half the damping: an explicit damper too strong for the inertia that it moves adds energy. Another ``factor``
    for a joint that moves too slowly."""
    return with_joints(
        case, overlay, lambda joint: set_by_search("damping", factor * joint.damping) if joint.damping > 0.0 else {}
    )


def more_friction(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """More dry friction, at least the rolling resistance at this weight; none on joints with a spring."""
    search, weight = case.settings.search, overlay.mass_kg * GRAVITY_M_S2
    count = sum(case.about(joint) for joint in overlay.joints)

    def change(joint: JointPhysics) -> dict[str, object]:
        if joint.stiffness > 0.0:
            return {}
        size = max(case.features.link(case.features.joint(joint.name).child).box_size) * overlay.scale
        lever = 1.0 if joint.type == "prismatic" else size / 2.0
        resistance = search.rolling_resistance * weight * lever / count
        return set_by_search("friction", max(search.mend_factor * joint.friction, resistance))

    return with_joints(case, overlay, change)


def with_more_damping(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """More damping and more friction together, for a part that does not come to rest."""
    damped = more_damping(case, overlay)
    rubbed = more_friction(case, damped or overlay)
    return rubbed or damped


def firmer_hold(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """More friction on a joint that must stay where it is placed."""

    def change(joint: JointPhysics) -> dict[str, object]:
        friction = HOLD_FRICTION_FACTOR * max(joint.friction, abs(joint.gravity_load))
        return set_by_search("friction", friction) if joint.stiffness == 0.0 or joint.holds else {}

    return with_joints(case, overlay, change)


def less_friction(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Less dry friction on a joint that sticks where it should move."""

    def change(joint: JointPhysics) -> dict[str, object]:
        loose = joint.friction > 0.0 and not joint.holds
        return set_by_search("friction", LOOSENING_FACTOR * joint.friction) if loose else {}

    return with_joints(case, overlay, change)


def looser_hold(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Less friction on a joint that takes more than a hand or its object's stand allows, down to what holds it."""

    def change(joint: JointPhysics) -> dict[str, object]:
        spring = joint.exerted(joint.initial_position)
        least = case.settings.physics.least_hold_margin * abs(joint.gravity_load + spring) if joint.holds else 0.0
        friction = max(LOOSER_FACTOR * joint.friction, least)
        return set_by_search("friction", friction) if friction < 0.999 * joint.friction else {}

    return with_joints(case, overlay, change)


def lower_mass_ratio(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """More mass and inertia for light links that others hang from, where the mass ratio exceeds a tenth of the solvers'
    limit. Keys and buttons keep their masses: they have an armature."""
    carriers = {joint.parent for joint in case.features.joints}
    heaviest = max(link.mass_kg for link in overlay.links)
    least = heaviest / (0.1 * case.settings.physics.max_mass_ratio)

    def raised(link: LinkPhysics) -> LinkPhysics:
        if link.name not in carriers or link.mass_kg >= least:
            return link
        inertia = tuple(least / link.mass_kg * term for term in link.inertia)
        sources = {"mass_source": Source.SEARCH, "inertia_source": Source.SEARCH}
        return link.model_copy(update={"mass_kg": least, "inertia": inertia, **sources})

    links = tuple(map(raised, overlay.links))
    return None if links == overlay.links else overlay.model_copy(update={"links": links})


def rolling_resistance(case: Case, overlay: PhysicsOverlay, least: float = ROLLING_M) -> PhysicsOverlay | None:
    """More rolling resistance, ``least`` (m) at least: on point contacts a rounded object rocks for ever."""
    more = min(max(least, 2.0 * overlay.rolling_friction_m), MOST_ROLLING_M)
    return overlay.model_copy(update={"rolling_friction_m": more}) if more > overlay.rolling_friction_m else None


def lie_down(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """The object written as it comes to rest, where that is near how it is authored, or where such things are put down
    on any side: a pen, a suitcase. A cabinet that topples is not mended by lying."""
    turn = Rotation.from_rotvec(case.rest_turn_rad)
    if turn.magnitude() < LEAST_TURN_RAD or (
        turn.magnitude() > AS_AUTHORED_RAD and not is_laid_down(case.features, overlay)
    ):
        return None
    whole = turn * Rotation.from_rotvec(overlay.turned_rad)
    return overlay.model_copy(update={"turned_rad": floats_of(whole.as_rotvec())})


def lie_broad(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """The object laid on its broadest side, its moving parts on top, where such things are put down on any side: a
    suitcase that stands on an edge, or does not bear its open lid."""
    features, edges = case.features, case.features.closed_size
    thin = min(range(3), key=lambda axis: edges[axis])
    moved = {joint.child for joint in features.movable_joints}
    tops = [center[thin] for name, center in features.link_centers.items() if name in moved]
    rest = [center[thin] for name, center in features.link_centers.items() if name not in moved]
    if any(overlay.turned_rad) or thin == UP or not tops or not rest or not is_laid_down(features, overlay):
        return None
    side = [0.0, 0.0, 0.0]
    side[thin] = 1.0 if sum(tops) / len(tops) >= sum(rest) / len(rest) else -1.0
    turn, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [side])
    return overlay.model_copy(update={"turned_rad": floats_of(turn.as_rotvec())})


_DAMPED = Remedy("more damping", more_damping)
_FIRMER, _HOLD = Remedy("more damping and friction", with_more_damping), Remedy("firmer hold", firmer_hold)
_ROLLING, _BROAD = Remedy("rolling resistance", rolling_resistance), Remedy("laid on its broadest side", lie_broad)
_EXPLOSION = (Remedy("less damping", less_damping), Remedy("mass ratio lowered", lower_mass_ratio))
# What rocks on the rim of a round foot may rock on under little, from one start of several.
_STILL = (_FIRMER, _ROLLING, Remedy("rolling resistance of a foot", partial(rolling_resistance, least=MOST_ROLLING_M)))
_LOOSER = (
    Remedy("less friction", less_friction),
    Remedy("less damping", partial(less_damping, factor=LOOSENING_FACTOR)),
)

_REMEDIES: dict[FailureMode, tuple[Remedy, ...]] = {
    FailureMode.STANDS: (Remedy("written as it lies", lie_down), _BROAD),
    FailureMode.STATE: (_HOLD, _DAMPED),
    FailureMode.OSCILLATION: (_FIRMER,),
    FailureMode.DRIFT: (_FIRMER, _ROLLING, *_EXPLOSION),
    FailureMode.DROP: (*_EXPLOSION, _FIRMER),
    FailureMode.NUDGE: (_DAMPED, Remedy("more friction", more_friction), *_EXPLOSION),
    FailureMode.HOLD: (_HOLD,),
    FailureMode.RELEASE: _LOOSER,
    FailureMode.EFFORT: (Remedy("looser hold", looser_hold), _BROAD),
    FailureMode.RESET: (_DAMPED, _HOLD, _FIRMER),
}
"""Failing check → remedies, least intrusive first. Penetration and jams are mended by state and collision shape."""


def has_remedies(mode: FailureMode) -> bool:
    """Whether a failing check has remedies in the dynamics."""
    return bool(_declared(mode))


def remedies_for(mode: FailureMode, limit: float | None, settings: Settings) -> tuple[Remedy, ...]:
    """Remedies for a failing check with this ``limit``: an object that does not come to rest needs more damping."""
    if mode in (FailureMode.DROP, FailureMode.RESET) and limit == settings.thresholds.final_speed_m_s:
        return _STILL
    return _declared(mode)


def _declared(mode: FailureMode) -> tuple[Remedy, ...]:
    check = check_of(mode)
    return _REMEDIES.get(mode) or (() if check is None else check.remedies)
