"""Findings on authored physics that is impossible or that no engine can step; nothing is changed.

Validation replaces such numbers anyway; the findings record them, also for an asset that is measured as authored.
"""

import math
from dataclasses import dataclass

import numpy as np

from asset2sim.assets.authored import authored_overlay
from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.document import known_robot
from asset2sim.assets.urdf.read import Dynamics, read_dynamics
from asset2sim.guidance.amounts import LARGEST_M, SMALLEST_M
from asset2sim.guidance.parts import part_name
from asset2sim.physics.inertia import tensor_of
from asset2sim.physics.kinematics import rigid_links, tree_of
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, Body, joint_space
from schemas.features import Features, JointFeatures, LinkFeatures, LinkInertial
from schemas.finding import Finding, Notes
from schemas.settings import PhysicsSettings

LEAST_DENSITY_KG_M3 = 1.0
"""Least density of a link over its solid volume, kg/m³: foamed plastics have 10, air 1.2."""
TRIANGLE_SLACK = 1e-4
"""Share by which the largest principal moment may exceed the sum of the others: files round their numbers."""
REVERSING_STEP = 1.0
"""Damping · Δt / I_eff, or stiffness · Δt² / I_eff, at the coarse step from which an explicit step reverses motion."""
UNDAMPED_RATIO = 0.05
"""Damping ratio below which a spring rings: it swings ten times before it has lost nine tenths."""
BOX_MARGIN = 0.1
"""How far outside its link's box, as a share of the box, a stated or proposed centre of mass may lie."""
OTHER_UNIT = 100.0
"""Size of an object that is too large over the longest offset of its joints, from which its meshes are in another unit:
in one of one unit it is seldom over 10."""
LONGEST_SLIDE = 10.0
"""Range of a slider over the object's longest edge from which it is not believed: a telescopic pole of ten parts."""
FULLY_OUT = 1.2
"""Range of a drawer over its length from which it leaves its slides: those that go furthest go a tenth beyond it."""
AXIS_SLACK = 1e-3
"""Rounding slack in a unit axis' length."""
NO_INERTIA = 1e-15
"""Added to every moment, kg·m², so that a link without any leaves the mass matrix invertible."""


def stated_findings(extraction: Extraction, settings: PhysicsSettings) -> tuple[Finding, ...]:
    """A warning for every authored value that makes no physical sense, or that is missing where others are stated."""
    notes, features = Notes(), extraction.features
    warn_of_size(features, notes)
    bare = [link.name for link in features.links if link.has_geometry and link.inertial is None]
    if len(bare) == sum(link.has_geometry for link in features.links):
        notes.info("no_inertials", "no link states a mass and an inertia; engines would invent them")
        bare = []
    for name in bare:
        notes.warn("inertial_missing", f"link '{name}' states no mass or inertia, as others do", link=name)
    for link in features.links:
        if link.inertial is not None:
            warn_of_mass(link, link.inertial, settings, notes)
            warn_of_centre(link, link.inertial, notes)
            warn_of_inertia(link, link.inertial, settings, notes)
    warn_of_dynamics(extraction, settings, notes)
    return tuple(notes.findings)


def warn_of_size(features: Features, notes: Notes) -> None:
    """Warn where the object's longest edge is not that of a household object."""
    longest = max(features.rest_size)
    if not SMALLEST_M <= longest <= LARGEST_M:
        message = (
            f"its longest edge is {longest:.4g} m; household objects have {SMALLEST_M:g} to {LARGEST_M:g} m: are its "
            "lengths in metres?"
        )
        notes.warn("size_implausible", message, value=longest, limit=LARGEST_M if longest > LARGEST_M else SMALLEST_M)
    apart = max((math.dist(joint.origin_xyz, (0.0, 0.0, 0.0)) for joint in features.joints), default=0.0)
    if longest > LARGEST_M and 0.0 < apart < longest / OTHER_UNIT:
        message = (
            f"its joints are at most {apart:.3g} m from their parents, its meshes {longest:.3g} m large: likely "
            'in millimetres, which no loader knows of OBJ and STL; state scale="0.001 0.001 0.001" in their <mesh>'
        )
        notes.warn("mesh_units", message, value=longest / apart, limit=OTHER_UNIT)


def warn_of_mass(link: LinkFeatures, stated: LinkInertial, settings: PhysicsSettings, notes: Notes) -> None:
    """Warn where a link's stated mass is zero, or implausible for its volume."""
    where, kilograms = f"link '{link.name}'", stated.mass_kg
    if kilograms < settings.smallest_mass_kg:
        message = f"{where} states a mass of {kilograms:.3g} kg; a moving link without mass freezes or explodes"
        notes.warn("mass_zero", message, link=link.name, value=kilograms, limit=settings.smallest_mass_kg)
        return
    # Tiny parts weigh a gram in every simulation, for the solver's sake.
    densest = max(settings.max_density_kg_m3 * max(link.volume_m3, link.hull_volume_m3), settings.min_mass_kg)
    lightest = LEAST_DENSITY_KG_M3 * link.volume_m3
    if link.hull_volume_m3 > 0.0 and not lightest <= kilograms <= densest:
        notes.warn(
            "mass_unbelievable",
            f"{where} states {kilograms:.3g} kg; a body of its size weighs {lightest:.3g} to {densest:.3g} kg",
            link=link.name,
            value=kilograms,
            limit=densest if kilograms > densest else lightest,
        )


def warn_of_centre(link: LinkFeatures, stated: LinkInertial, notes: Notes) -> None:
    """Warn where a link's stated centre of mass lies outside its box."""
    if not link.has_geometry:
        return
    low, high, com = np.asarray(link.box_min), np.asarray(link.box_max), np.asarray(stated.com)
    outside = float(np.maximum(low - com, com - high).max())
    if np.any(
        np.maximum(low - com, com - high) > BOX_MARGIN * np.maximum(high - low, 0.1 * float(np.ptp([low, high])))
    ):
        message = f"link '{link.name}' states a centre of mass that lies {outside:.3g} m outside its geometry"
        notes.warn("com_outside", message, link=link.name, value=outside, limit=0.0)


def warn_of_inertia(link: LinkFeatures, stated: LinkInertial, settings: PhysicsSettings, notes: Notes) -> None:
    """Warn where a link's stated inertia is impossible, or implausible for its shape and mass."""
    moments = np.linalg.eigvalsh(tensor_of(stated.inertia))
    where = f"link '{link.name}'"
    if moments[0] < 0.99 * settings.min_inertia_kg_m2:
        message = f"{where} states a principal moment of {moments[0]:.3g} kg·m²; engines take it for none"
        notes.warn(
            "inertia_singular", message, link=link.name, value=float(moments[0]), limit=settings.min_inertia_kg_m2
        )
    elif moments[2] > (1.0 + TRIANGLE_SLACK) * (moments[0] + moments[1]):
        message = (
            f"{where} states principal moments {', '.join(f'{v:.3g}' for v in moments)} kg·m²: no body has one "
            "above the sum of the others"
        )
        notes.warn(
            "inertia_impossible", message, link=link.name, value=float(moments[2]), limit=float(moments[0] + moments[1])
        )
    if not link.has_geometry:
        return
    expected = stated.mass_kg * float(np.trace(tensor_of(link.unit_inertia)))
    ratio = float(moments.sum()) / max(expected, 1e-300)
    if stated.mass_kg > 0.0 and not 1.0 / settings.inertia_factor <= ratio <= settings.inertia_factor:
        notes.warn(
            "inertia_unbelievable",
            f"{where} states an inertia {ratio:.3g} times what its shape and mass give: is it in kg·m²?",
            link=link.name,
            value=ratio,
            limit=settings.inertia_factor if ratio > 1.0 else 1.0 / settings.inertia_factor,
        )


@dataclass(frozen=True)
class StatedJoint:
    """A joint as its URDF states it, before extraction completes it; ``axis`` is the length of the axis vector,
    ``limits`` lower and upper, where there are both."""

    type: str
    axis: float | None
    effort: float | None
    velocity: float | None
    limits: tuple[float, float] | None


def warn_of_dynamics(extraction: Extraction, settings: PhysicsSettings, notes: Notes) -> None:
    """Warn of implausible dynamics of movable joints, given the inertia that they move by the stated masses."""
    features, tree = extraction.features, tree_of(extraction.features.joints)
    terms, raw = read_dynamics(extraction.urdf), read_stated_joints(extraction)
    moves = stated_inertias(extraction, settings)
    weight = sum(link.inertial.mass_kg for link in features.links if link.inertial is not None) * GRAVITY_M_S2
    for joint in features.movable_joints:
        lever = 1.0 if joint.prismatic else max(features.rest_size)
        moved = rigid_links(tree, joint.name)
        if not any(features.link(name).has_geometry for name in moved):
            message = (
                f"joint '{joint.name}' moves '{moved[0]}', and no link there has a shape: nothing is seen or touched "
                "of it; give it a shape (a program may add it), or make the joint fixed"
            )
            notes.warn("moves_nothing", message, joint=joint.name, link=moved[0])
        warn_of_form(joint, raw[joint.name], notes)
        warn_of_reach(joint, features, notes)
        warn_of_signs(joint, terms[joint.name], notes)
        warn_of_steps(joint, terms[joint.name], moves.get(joint.name, 0.0), settings, notes)
        effort = raw[joint.name].effort
        limit = min(weight * lever or math.inf, effort if effort is not None and effort > 0.0 else math.inf)
        if terms[joint.name].friction > limit:
            message = (
                f"joint '{joint.name}' states a friction of {terms[joint.name].friction:.3g}, more than its effort "
                f"limit or the object's whole weight on it ({limit:.3g} {'N' if joint.prismatic else 'N·m'}): it "
                "never moves"
            )
            notes.warn("friction_sticks", message, joint=joint.name, value=terms[joint.name].friction, limit=limit)


def warn_of_form(joint: JointFeatures, raw: StatedJoint, notes: Notes) -> None:
    """Warn where a joint's axis has no unit length, limits are missing or count for nothing, or its effort or velocity
    limit is zero."""
    where = f"joint '{joint.name}'"
    if raw.axis is not None and abs(raw.axis - 1.0) > AXIS_SLACK:
        message = f"{where} has an axis of length {raw.axis:.4g}; engines differ in what they make of it"
        notes.warn("axis_not_unit", message, joint=joint.name, value=raw.axis, limit=1.0)
    if raw.type == "revolute" and joint.type == "continuous":
        notes.warn("limits_missing", f"{where} is revolute and states no limits; it turns freely", joint=joint.name)
    if raw.type == "continuous" and raw.limits is not None and 0.0 < raw.limits[1] - raw.limits[0] < math.tau:
        low, high = raw.limits
        message = (
            f"{where} is continuous, so its limits {low:.4g} to {high:.4g} rad count for nothing and it turns freely; "
            "write it as revolute if they are meant"
        )
        notes.warn("limits_ignored", message, joint=joint.name, value=high - low, limit=math.tau)
    for what, value in (("effort", raw.effort), ("velocity", raw.velocity)):
        if value is not None and value <= 0.0:
            message = f"{where} has a limit of {value:g} on its {what}: no motor moves it"
            notes.warn(f"{what}_zero", message, joint=joint.name)


def warn_of_reach(joint: JointFeatures, features: Features, notes: Notes) -> None:
    """Warn where a slider's range is many times the object's longest edge, or takes a drawer out of what holds it."""
    if not joint.prismatic or joint.lower is None or joint.upper is None:
        return
    span, longest = abs(joint.upper - joint.lower), max(features.rest_size)
    if span > LONGEST_SLIDE * longest > 0.0:
        message = (
            f"joint '{joint.name}' slides over {span:.4g} m, {span / longest:.3g} times the object's longest edge: is "
            "its range in metres?"
        )
        notes.warn("range_implausible", message, joint=joint.name, value=span / longest, limit=LONGEST_SLIDE)
    length = float(np.abs(joint.axis_in_root) @ features.link_boxes.get(joint.child, (0.0, 0.0, 0.0)))
    names = joint.child, joint.name, features.asset_id
    drawer = part_name(features.link(joint.child).label, *names) == "drawer"
    if drawer and span > FULLY_OUT * length > 0.0:
        message = (
            f"joint '{joint.name}' slides a drawer of {length:.4g} m by {span:.4g} m: it leaves what holds it; state a "
            "range of at most its length"
        )
        notes.warn("drawer_leaves", message, joint=joint.name, value=span, limit=length)


def warn_of_signs(joint: JointFeatures, terms: Dynamics, notes: Notes) -> None:
    """Warn where a joint's damping, friction or stiffness is negative."""
    for what in ("damping", "friction", "stiffness"):
        value = float(getattr(terms, what))
        if value < 0.0:
            message = (
                f"joint '{joint.name}' states a {what} of {value:.3g}, which feeds its motion instead of braking it"
            )
            notes.warn(f"{what}_negative", message, joint=joint.name, value=value, limit=0.0)


def warn_of_steps(joint: JointFeatures, terms: Dynamics, moves: float, settings: PhysicsSettings, notes: Notes) -> None:
    """Warn of damping or stiffness that is unstable in an explicit step at 60 Hz, and of springs without damping.
    ``moves`` is the joint's effective inertia, kg·m² or kg; without effect where it is not positive."""
    if moves <= 0.0:
        return
    step, where = settings.coarse_timestep_s, f"joint '{joint.name}'"
    damping, stiffness = terms.damping * step / moves, terms.stiffness * step**2 / moves
    for what, share, value in (("damping", damping, terms.damping), ("stiffness", stiffness, terms.stiffness)):
        if share > REVERSING_STEP:
            message = (
                f"{where} states a {what} of {value:.3g}, {share:.3g} times what the {moves:.3g} "
                f"{'kg' if joint.prismatic else 'kg·m²'} it moves stand at {1.0 / step:.0f} Hz"
            )
            notes.warn(f"{what}_unstable", message, joint=joint.name, value=share, limit=REVERSING_STEP)
    if terms.stiffness > 0.0 and terms.friction <= 0.0:
        ratio = max(terms.damping, 0.0) / (2.0 * math.sqrt(terms.stiffness * moves))
        if ratio < UNDAMPED_RATIO:
            message = f"{where} states a spring with a damping ratio of {ratio:.3g}: it rings and never comes to rest"
            notes.warn("spring_undamped", message, joint=joint.name, value=ratio, limit=UNDAMPED_RATIO)


def stated_inertias(extraction: Extraction, settings: PhysicsSettings) -> dict[str, float]:
    """Joint → effective inertia by the stated masses, every joint at zero; empty where no link states one."""
    features = extraction.features
    if all(link.inertial is None for link in features.links):
        return {}
    overlay = authored_overlay(extraction, settings)
    bodies = {
        link.name: Body(link.mass_kg, np.asarray(link.com), tensor_of(link.inertia) + NO_INERTIA * np.eye(3))
        for link in overlay.links
    }
    try:
        return joint_space(tree_of(features.joints), features.root, bodies, {}).effective_inertia()
    except np.linalg.LinAlgError:
        return {}


def read_stated_joints(extraction: Extraction) -> dict[str, StatedJoint]:
    """Joint → its type, axis length, effort and velocity limit as the URDF states them."""
    found: dict[str, StatedJoint] = {}
    for element in known_robot(extraction.urdf).findall("joint"):
        axis, limit = element.find("axis"), element.find("limit")
        length = None
        if axis is not None and axis.get("xyz"):
            length = float(np.linalg.norm([float(word) for word in str(axis.get("xyz")).split()]))
        given = dict[str, str]() if limit is None else {str(key): str(text) for key, text in limit.attrib.items()}
        number = {key: float(text) for key, text in given.items() if key in ("effort", "velocity", "lower", "upper")}
        both = (number["lower"], number["upper"]) if {"lower", "upper"} <= number.keys() else None
        found[str(element.get("name"))] = StatedJoint(
            str(element.get("type")), length, number.get("effort"), number.get("velocity"), both
        )
    return found
