"""Whether a defect is left in a refined folder: each function returns the reason, or an empty text if it is gone. Pure.
The written URDF and its meshes are inspected, not the overlay from which they were written; positions and effective
inertias, which no URDF holds, are from the record."""

import numpy as np
import trimesh
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.read import Dynamics, read_dynamics
from asset2sim.intake.blocked_joints import find_blocked_joints
from asset2sim.intake.locate import find_source
from asset2sim.intake.origin import extract
from asset2sim.physics.arrays import Array
from asset2sim.physics.inertia import tensor_of
from lab.defects.planting import RefinedAsset, Target, collision_files, named, numbers, part
from schemas.overlay import JointPhysics
from schemas.settings import PhysicsSettings

MASS_FACTOR, INERTIA_FACTOR = 3.0, 5.0
"""Largest ratio of a mended mass or inertia to the clean one: two priors for the same part differ by that."""
NEAR_SHARE = 0.2
"""Largest distance of a mended position from the clean one, as a share of the part's or the range's extent."""
FILLED_FACTOR = 2.0
"""Volume of the collision meshes over the clean ones' from which their inside still counts as filled."""
OVERLAP_M = 2e-3
"""Overlap of two links that contact margins can cause, m."""
MIN_DAMPING_RATIO = 0.3
"""Least damping ratio of a spring that comes to rest soon."""
HAND_FACTOR = 3.0
"""Friction over the clean one's, or over the part's weight, from which a hand cannot move it."""
STICKS_FACTOR = 20.0
"""Friction over the clean one's from which a joint still sticks."""


def robot_of(kept: RefinedAsset) -> Element:
    """The root element of the written URDF."""
    return etree.parse(str(find_source(kept.folder))).getroot()


def joint_of(kept: RefinedAsset, at: Target) -> JointPhysics:
    """The target joint in the record; KeyError if it is not movable there."""
    overlay = kept.record.overlay
    for joint in () if overlay is None else overlay.joints:
        if joint.name == at.joint:
            return joint
    raise KeyError(f"joint '{at.joint}' is not movable")


def terms_of(kept: RefinedAsset, at: Target) -> Dynamics:
    """The target joint's dynamics as written."""
    return read_dynamics(find_source(kept.folder))[at.joint]


def inertial_of(kept: RefinedAsset, at: Target) -> tuple[float, Array, Array]:
    """The target link's mass (kg), (3,) centre and (3, 3) inertia as written."""
    inertial = named(robot_of(kept), "link", at.link, "inertial")
    inertia = part(inertial, "inertia")
    six = [float(str(inertia.get(key))) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")]
    mass = float(str(part(inertial, "mass").get("value")))
    return mass, numbers(part(inertial, "origin"), "xyz"), tensor_of((six[0], six[1], six[2], six[3], six[4], six[5]))


def mass_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the mass or the inertia is far from the clean one, or the inertia is not physical."""
    (good, _, tensor), (found, _, inertia) = inertial_of(clean, at), inertial_of(mended, at)
    if not 1.0 / MASS_FACTOR <= found / good <= MASS_FACTOR:
        return f"mass of '{at.link}' is {found:.3g} kg, {found / good:.3g} times the clean one"
    moments = np.linalg.eigvalsh(inertia)
    if moments[0] <= 0.0 or moments[2] > (1.0 + 1e-4) * (moments[0] + moments[1]):
        return f"inertia of '{at.link}' is that of no body"
    ratio = float(np.trace(inertia) / np.trace(tensor))
    if not 1.0 / INERTIA_FACTOR <= ratio <= INERTIA_FACTOR:
        return f"inertia of '{at.link}' is {ratio:.3g} times the clean one"
    return ""


def centre_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the centre of mass is away from the clean one, or the mass is wrong."""
    away = float(np.linalg.norm(inertial_of(mended, at)[1] - inertial_of(clean, at)[1]))
    if away > near_m(clean, at):
        return f"centre of mass of '{at.link}' is {away:.3g} m from the clean one"
    return mass_left(clean, mended, at)


def damping_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the damping is negative, or above the stability limit at the coarse time step."""
    settings, joint, found = PhysicsSettings(), joint_of(mended, at), terms_of(mended, at).damping
    share = found * settings.coarse_timestep_s / joint.effective_inertia
    if found < 0.0 or share > 1.01 * settings.max_damping_step:
        return f"damping of '{at.joint}' is {found:.3g}, {share:.3g} of what it moves per step"
    return ""


def spring_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the spring is unstable at the coarse time step, or underdamped."""
    settings, joint, found = PhysicsSettings(), joint_of(mended, at), terms_of(mended, at)
    inertia = joint.effective_inertia + joint.armature
    share = found.stiffness * settings.coarse_timestep_s**2 / inertia
    if found.stiffness < 0.0 or share > 1.01 * settings.max_stiffness_step:
        return f"stiffness of '{at.joint}' is {found.stiffness:.3g}, {share:.3g} of what it moves per step"
    if found.stiffness > 0.0 and joint.armature == 0.0:  # one with an armature rests on its stop
        ratio = found.damping / (2.0 * np.sqrt(found.stiffness * joint.effective_inertia))
        if ratio < MIN_DAMPING_RATIO:
            return f"the spring of '{at.joint}' has a damping ratio of {ratio:.3g}"
    return damping_left(clean, mended, at)


def friction_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the friction is negative or far above the clean one, or the joint is stuck in an engine."""
    good, found = terms_of(clean, at).friction, terms_of(mended, at).friction
    if not 0.0 <= found <= STICKS_FACTOR * good:
        return f"friction of '{at.joint}' is {found:.3g}, the clean one {good:.3g}"
    for report in mended.record.reports:
        for opening in () if report.interaction is None else report.interaction.openings:
            if opening.joint == at.joint and opening.stuck:
                return f"'{at.joint}' is stuck in {report.engine.value}"
    return ""


def hand_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the friction is beyond what holds the clean joint and a hand can move."""
    found, good = terms_of(mended, at).friction, terms_of(clean, at).friction
    most = HAND_FACTOR * max(good, abs(joint_of(clean, at).gravity_load))
    return f"friction of '{at.joint}' is {found:.3g}, the clean one {good:.3g}" if found > most else ""


def effort_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the effort limit is zero or negative."""
    effort = float(named(robot_of(mended), "joint", at.joint, "limit").get("effort", "0"))
    return "" if effort > 0.0 else f"'{at.joint}' has an effort limit of {effort:g}"


def axis_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the axis is not of unit length, or does not point along the clean one."""
    good, found = (numbers(named(robot_of(kept), "joint", at.joint, "axis"), "xyz") for kept in (clean, mended))
    if abs(float(np.linalg.norm(found)) - 1.0) > 1e-3:
        return f"axis of '{at.joint}' has length {np.linalg.norm(found):.3g}"
    return f"axis of '{at.joint}' points elsewhere than the clean one" if float(good @ found) < 0.99 else ""


def limits_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the limits are missing, not in order, or not near the clean ones."""
    (low, high), (lower, upper) = (limits_of(kept, at) for kept in (clean, mended))
    if lower is None or upper is None or low is None or high is None:
        return f"'{at.joint}' has no limits"
    slack = NEAR_SHARE * (high - low)
    if not lower < upper or abs(lower - low) > slack or abs(upper - high) > slack:
        return f"'{at.joint}' goes from {lower:.3g} to {upper:.3g}, the clean one from {low:.3g} to {high:.3g}"
    return ""


def passage_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if limits are missing, exclude part of the clean range, or let the part pass through another."""
    (low, high), (lower, upper) = (limits_of(kept, at) for kept in (clean, mended))
    if lower is None or upper is None or low is None or high is None:
        return f"'{at.joint}' has no limits"
    slack = NEAR_SHARE * (high - low)
    if lower > low + slack or upper < high - slack:
        return f"'{at.joint}' goes from {lower:.3g} to {upper:.3g}, less than the clean one"
    ref = mended.record.ref.model_copy(update={"path": str(mended.folder), "root": None})
    blocked = find_blocked_joints(extract(ref))[1]
    return next((finding.message for finding in blocked if finding.joint == at.joint), "")


def start_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the initial position is outside the limits."""
    (lower, upper), start = limits_of(mended, at), joint_of(mended, at).initial_position
    if lower is None or upper is None or not lower - 1e-6 <= start <= upper + 1e-6:
        return f"'{at.joint}' starts at {start:.3g}, outside {lower} to {upper}"
    return ""


def limits_of(kept: RefinedAsset, at: Target) -> tuple[float | None, float | None]:
    """The target joint's limits as written."""
    limit = named(robot_of(kept), "joint", at.joint).find("limit")
    if limit is None or limit.get("lower") is None:
        return None, None
    return float(str(limit.get("lower"))), float(str(limit.get("upper")))


def pivot_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the hinge is away from the clean one."""
    good, found = (numbers(named(robot_of(kept), "joint", at.joint, "origin"), "xyz") for kept in (clean, mended))
    away = float(np.linalg.norm(found - good))
    return f"hinge '{at.joint}' is {away:.3g} m from the clean one" if away > near_m(clean, at) else ""


def overlap_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the target link overlaps another in the initial state."""
    for overlap in mended.record.overlaps:
        pair = overlap.pair
        if at.link in (pair.link_a, pair.link_b) and pair.depth_m > OVERLAP_M:
            return f"'{pair.link_a}' and '{pair.link_b}' overlap by {1e3 * pair.depth_m:.3g} mm"
    return ""


def shape_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if collision meshes are unusable, or their box or volume is not that of the clean ones."""
    problem = meshes_left(mended, at.link)
    if problem:
        return problem
    good, found = collision_box(clean, at.link), collision_box(mended, at.link)
    if max(float(np.abs(a - b).max()) for a, b in zip(good, found, strict=True)) > near_m(clean, at):
        return f"collision shapes of '{at.link}' are not where the clean ones are"
    volume, clean_volume = (sum(abs(mesh.volume) for mesh in meshes_of(kept, at.link)) for kept in (mended, clean))
    ratio = float(volume / clean_volume)
    if not 1.0 / FILLED_FACTOR <= ratio <= FILLED_FACTOR:
        return f"collision shapes of '{at.link}' hold {ratio:.3g} times the clean ones' volume"
    return ""


def meshes_left(kept: RefinedAsset, link: str) -> str:
    """Reason if a link's collision mesh is missing, not closed, not finite, or wound inwards."""
    files = collision_files(kept.folder, link)
    if not files:
        return f"'{link}' has no collision mesh"
    for path in files:
        if not path.is_file():
            return f"{path.name} is not there"
        mesh = trimesh.load_mesh(str(path), process=False)
        if not np.isfinite(mesh.vertices).all() or not mesh.is_watertight or mesh.volume <= 0.0:
            return f"{path.name} is not a closed mesh of finite vertices, wound outwards"
    return ""


def size_left(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason if the whole object is not about as large as the clean one."""
    sizes = []
    for kept in (clean, mended):
        features, overlay = kept.record.features, kept.record.overlay
        if features is None or overlay is None:
            return "the record holds no features"
        sizes.append(max(features.rest_size) * overlay.scale)
    ratio = sizes[1] / sizes[0]
    return "" if 0.5 <= ratio <= 2.0 else f"it is {ratio:.3g} times as large as the clean one"


def near_m(clean: RefinedAsset, at: Target) -> float:
    """Largest distance from its clean position at which something of the target link counts as near it, m."""
    low, high = collision_box(clean, at.link)
    return NEAR_SHARE * float(np.linalg.norm(high - low))


def collision_box(kept: RefinedAsset, link: str) -> tuple[Array, Array]:
    """The (3,) minimum and maximum of a link's collision meshes, m; as written, they lie in the link's frame."""
    points = np.vstack([mesh.vertices for mesh in meshes_of(kept, link)])
    return points.min(axis=0), points.max(axis=0)


def meshes_of(kept: RefinedAsset, link: str) -> list[trimesh.Trimesh]:
    """A link's collision meshes as written."""
    return [trimesh.load_mesh(str(path), process=False) for path in collision_files(kept.folder, link)]


def never_mended(clean: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
    """Reason for a defect that cannot be mended without guessing: it always counts as left."""
    return "what was written is a guess"
