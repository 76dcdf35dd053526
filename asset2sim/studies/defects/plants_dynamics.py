"""Defects of joint damping, friction, springs and efforts."""

import math
from pathlib import Path

from asset2sim.studies.defects.planting import PlantedChange, Target, edited_part, write
from schemas.overlay import PhysicsOverlay
from schemas.settings import PhysicsSettings

UNSTABLE_FACTOR = 200.0
"""PlantedChange damping or stiffness over the stability limit at the coarse time step."""
RINGING_HZ = 3.0
"""Frequency of the spring that is left without damping, Hz."""
STICKING_FRICTION = 1e4
"""Friction of a joint that no effort can move, N·m or N."""


def effective_inertia(folder: Path, joint: str) -> float:
    """Effective inertia of a joint from the overlay beside the URDF, kg·m² or kg."""
    overlay = PhysicsOverlay.model_validate_json((folder / "overlay.json").read_bytes())
    return next(item.effective_inertia for item in overlay.joints if item.name == joint)


def dynamics(folder: Path, at: Target, **terms: float) -> PlantedChange:
    """Write terms of a joint's dynamics."""
    with edited_part(folder, "joint", at.joint, "dynamics") as element:
        for key, value in terms.items():
            write(element, key, value)
    said = ", ".join(f"{key} {value:.3g}" for key, value in terms.items())
    return PlantedChange(f"'{at.joint}' has {said}", joints=(at.joint,))


def damping_unstable(folder: Path, at: Target) -> PlantedChange:
    """Damping far above the stability limit of an explicit step: a value for another object."""
    step = PhysicsSettings().coarse_timestep_s
    return dynamics(folder, at, damping=UNSTABLE_FACTOR * effective_inertia(folder, at.joint) / step)


def damping_negative(folder: Path, at: Target) -> PlantedChange:
    """Negative damping, which adds energy: a wrong symptom."""
    return dynamics(folder, at, damping=-10.0 * effective_inertia(folder, at.joint))


def spring_undamped(folder: Path, at: Target) -> PlantedChange:
    """A spring without damping or friction."""
    stiffness = (2.0 * math.pi * RINGING_HZ) ** 2 * effective_inertia(folder, at.joint)
    return dynamics(folder, at, spring_stiffness=stiffness, damping=0.0, friction=0.0)


def stiffness_unstable(folder: Path, at: Target) -> PlantedChange:
    """A spring that is too stiff for any usual time step."""
    step = PhysicsSettings().coarse_timestep_s
    return dynamics(folder, at, spring_stiffness=UNSTABLE_FACTOR * effective_inertia(folder, at.joint) / step**2)


def friction_sticks(folder: Path, at: Target) -> PlantedChange:
    """Friction that is too high to overcome."""
    return dynamics(folder, at, friction=STICKING_FRICTION)


def friction_negative(folder: Path, at: Target) -> PlantedChange:
    """Friction with a wrong symptom."""
    return dynamics(folder, at, friction=-effective_inertia(folder, at.joint))


def effort_zero(folder: Path, at: Target) -> PlantedChange:
    """An effort limit of zero, as some exporters write for an unknown one."""
    with edited_part(folder, "joint", at.joint, "limit") as limit:
        write(limit, "effort", 0.0)
    return PlantedChange(f"'{at.joint}' has an effort limit of 0", joints=(at.joint,))
