"""What can mend a failing test: each remedy is a pure function from an overlay to another one, or to None.

A remedy changes as little as may help and stays within the bounds of validation: damping within what the time
step bears, inertia upwards only, friction never against a spring.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.features import Features
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Source

ROLLING_M = 5e-4
"""Lever of rolling resistance that keeps a rounded object from rocking for ever, m: half a millimetre, as of hard
things on wood."""
ROUGHEST = 1.0
"""Contact friction that a remedy may reach: rubber on a table."""
FIRMER_HOLD = 2.0
"""By how much the friction of a joint that slips grows each time."""
FREER = 0.3
"""By how much the friction or damping of a joint that sticks shrinks each time."""
HEAVIER = 3.0
"""By how much the inertia of the lightest links grows each time an object explodes."""
LIGHT_SHARE = 0.1
"""Inertia over the heaviest link's below which a link counts as light."""


@dataclass(frozen=True)
class Case:
    """What a remedy looks at: the asset, the settings, and the joints that the failing test is about (none: all)."""

    features: Features
    settings: Settings
    joints: tuple[str, ...]

    def about(self, joint: JointPhysics) -> bool:
        """Whether the failing test is about this joint."""
        return not self.joints or joint.name in self.joints


Change = Callable[[Case, PhysicsOverlay], PhysicsOverlay | None]


@dataclass(frozen=True)
class Remedy:
    """One way to change an overlay, and how it is called in the trace."""

    name: str
    change: Change


def with_joints(
    case: Case, overlay: PhysicsOverlay, change: Callable[[JointPhysics], dict[str, object]]
) -> PhysicsOverlay | None:
    """The overlay with ``change`` applied to the joints of the case; None where nothing changes."""
    joints = tuple(joint.model_copy(update=change(joint)) if case.about(joint) else joint for joint in overlay.joints)
    return None if joints == overlay.joints else overlay.model_copy(update={"joints": joints})


def least_inertia(joint: JointPhysics) -> float:
    """The least inertia that a joint moves over its range, kg·m² or kg; at the initial position if no more is known."""
    return joint.least_inertia or joint.effective_inertia


def largest_damping(case: Case, joint: JointPhysics) -> float:
    """The damping that the coarse time step bears, N·m·s/rad or N·s/m."""
    physics = case.settings.physics
    return physics.max_damping_step * least_inertia(joint) / physics.coarse_timestep_s


def more_damping(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Damping times ``mend_factor``, within the time step's bound (the paper: ×2 to ×5 on persistent oscillation)."""

    def change(joint: JointPhysics) -> dict[str, object]:
        damping = min(case.settings.search.mend_factor * joint.damping, largest_damping(case, joint))
        return {"damping": damping, "damping_source": Source.SEARCH} if damping > 1.001 * joint.damping else {}

    return with_joints(case, overlay, change)


def less_damping(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Half the damping: an explicit damper that is too strong for what it moves adds energy."""
    return with_joints(
        case,
        overlay,
        lambda joint: {"damping": 0.5 * joint.damping, "damping_source": Source.SEARCH} if joint.damping > 0.0 else {},
    )


def softer_spring(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Half the stiffness of a spring, its force at the reference position kept."""

    def change(joint: JointPhysics) -> dict[str, object]:
        if joint.stiffness <= 0.0:
            return {}
        away = joint.spring_reference - joint.initial_position
        return {
            "stiffness": 0.5 * joint.stiffness,
            "stiffness_source": Source.SEARCH,
            "spring_reference": joint.initial_position + 2.0 * away,
        }

    return with_joints(case, overlay, change)


def stiffer_spring(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Twice the stiffness, within what the time step bears."""

    def change(joint: JointPhysics) -> dict[str, object]:
        physics = case.settings.physics
        most = physics.max_stiffness_step * least_inertia(joint) / physics.coarse_timestep_s**2
        stiffness = min(2.0 * joint.stiffness, most)
        if stiffness <= 1.001 * joint.stiffness:
            return {}
        return {"stiffness": stiffness, "stiffness_source": Source.SEARCH}

    return with_joints(case, overlay, change)


def more_friction(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """More dry friction, at least a rolling part's at this weight; never where a spring must bring a part back."""
    search, weight = case.settings.search, overlay.mass_kg * GRAVITY_M_S2
    count = sum(case.about(joint) for joint in overlay.joints)

    def change(joint: JointPhysics) -> dict[str, object]:
        if joint.stiffness > 0.0:
            return {}
        size = max(case.features.link(case.features.joint(joint.name).child).box_size) * overlay.scale
        lever = 1.0 if joint.type == "prismatic" else size / 2.0
        resistance = search.rolling_resistance * weight * lever / count
        friction = max(search.mend_factor * joint.friction, resistance)
        return {"friction": friction, "friction_source": Source.SEARCH}

    return with_joints(case, overlay, change)


def firmer(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """More damping and more friction at once: what stops a part that will not come to rest."""
    damped = more_damping(case, overlay)
    rubbed = more_friction(case, damped or overlay)
    return rubbed or damped


def firmer_hold(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """More friction on a joint that must stay where it is placed."""
    return with_joints(
        case,
        overlay,
        lambda joint: (
            {
                "friction": max(FIRMER_HOLD * joint.friction, FIRMER_HOLD * abs(joint.gravity_load)),
                "friction_source": Source.SEARCH,
            }
            if joint.stiffness == 0.0
            else {}
        ),
    )


def less_friction(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Less dry friction on a joint that sticks where it should move."""
    return with_joints(
        case,
        overlay,
        lambda joint: (
            {"friction": FREER * joint.friction, "friction_source": Source.SEARCH}
            if joint.friction > 0.0 and not joint.holds
            else {}
        ),
    )


def freer(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Less damping on a joint that moves too slowly."""
    return with_joints(
        case,
        overlay,
        lambda joint: (
            {"damping": FREER * joint.damping, "damping_source": Source.SEARCH} if joint.damping > 0.0 else {}
        ),
    )


def more_inertia(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """More inertia for the links that are light beside the heaviest: solvers lose them between heavy neighbours."""

    def size(inertia: Sequence[float]) -> float:
        return float(inertia[0] + inertia[3] + inertia[5])

    heaviest = max(size(link.inertia) for link in overlay.links)
    links = tuple(
        link.model_copy(update={"inertia": tuple(HEAVIER * v for v in link.inertia), "inertia_source": Source.SEARCH})
        if size(link.inertia) < LIGHT_SHARE * heaviest
        else link
        for link in overlay.links
    )
    return None if links == overlay.links else overlay.model_copy(update={"links": links})


def closer_masses(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Heavier light links where the mass ratio is above what iterative solvers stand, their shape's inertia with it."""
    heaviest = max(link.mass_kg for link in overlay.links)
    least = heaviest / (0.1 * case.settings.physics.max_mass_ratio)
    links = tuple(
        link.model_copy(
            update={
                "mass_kg": least,
                "mass_source": Source.SEARCH,
                "inertia": tuple(least / link.mass_kg * v for v in link.inertia),
                "inertia_source": Source.SEARCH,
            }
        )
        if link.mass_kg < least
        else link
        for link in overlay.links
    )
    return None if links == overlay.links else overlay.model_copy(update={"links": links})


def rougher_contact(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """More friction of every contact, so that the object does not creep or slide."""
    friction = min(1.5 * overlay.contact_friction, ROUGHEST)
    if friction <= overlay.contact_friction:
        return None
    return overlay.model_copy(update={"contact_friction": friction})


def rolling_resistance(case: Case, overlay: PhysicsOverlay) -> PhysicsOverlay | None:
    """Resistance to rolling, where there is none: on ideal points a rounded thing rocks without end."""
    if overlay.rolling_friction_m > 0.0:
        return None
    return overlay.model_copy(update={"rolling_friction_m": ROLLING_M})


_EXPLOSION = (
    Remedy("less damping", less_damping),
    Remedy("more inertia of light links", more_inertia),
    Remedy("mass ratio lowered", closer_masses),
    Remedy("softer spring", softer_spring),
)

_STILL = (
    Remedy("more damping and friction", firmer),
    Remedy("rolling resistance", rolling_resistance),
    Remedy("rougher contact", rougher_contact),
    Remedy("more inertia of light links", more_inertia),
)

REMEDIES: dict[FailureMode, tuple[Remedy, ...]] = {
    FailureMode.OSCILLATION: (
        Remedy("more damping and friction", firmer),
        Remedy("softer spring", softer_spring),
    ),
    FailureMode.DRIFT: (
        Remedy("more damping and friction", firmer),
        Remedy("rolling resistance", rolling_resistance),
        Remedy("rougher contact", rougher_contact),
        *_EXPLOSION,
    ),
    FailureMode.DROP: (
        *_EXPLOSION,
        Remedy("more damping and friction", firmer),
        Remedy("rougher contact", rougher_contact),
    ),
    FailureMode.NUDGE: (Remedy("more damping", more_damping), Remedy("more friction", more_friction), *_EXPLOSION),
    FailureMode.HOLD: (Remedy("firmer hold", firmer_hold), Remedy("softer spring", softer_spring)),
    FailureMode.RELEASE: (
        Remedy("less friction", less_friction),
        Remedy("less damping", freer),
        Remedy("stiffer spring", stiffer_spring),
    ),
    FailureMode.RESET: (
        Remedy("firmer hold", firmer_hold),
        Remedy("more damping and friction", firmer),
        Remedy("rougher contact", rougher_contact),
    ),
}
"""Failing test → what can mend it, the least intrusive first. Penetration and jams are mended by state and shape."""


def remedies_for(mode: FailureMode, limit: float | None, settings: Settings) -> tuple[Remedy, ...]:
    """What can mend a failing test that met ``limit``: what will not come to rest needs the reverse of an explosion."""
    if mode in (FailureMode.DROP, FailureMode.RESET) and limit == settings.thresholds.final_speed_m_s:
        return _STILL
    return REMEDIES.get(mode, ())
