"""Findings on the physics that one joint was given: what a bound changed, what holds it, what its URDF leaves out."""

from asset2sim.physics.felt import effort_limit, plain_spring
from asset2sim.physics.terms import JointLoad, JointTerms, Term
from asset2sim.validation.handling import Handling
from asset2sim.validation.holding import Holding
from schemas.finding import Notes
from schemas.overlay import JointPhysics
from schemas.settings import PhysicsSettings


def report_holding(name: str, held_by: Holding, kind: Handling, prismatic: bool, notes: Notes) -> None:
    """Add a finding where a spring carries a part's weight, where a hand allows less friction than a bump needs, and
    where a screw turns in its plane."""
    if kind.mechanism == "screw" and not prismatic:
        least, most = kind.lever * kind.range.least_n, kind.lever * kind.range.most_n
        message = (
            f"joint '{name}': a screw: it turns with the grip of its kind, {least:.2g} to {most:.2g} N·m, and does not "
            "rise along its thread (caps of bottles by about 3 mm a turn)"
        )
        notes.info("screw_in_place", message, joint=name, value=least, limit=most)
    if held_by.balance.stiffness > 0.0:
        stiffness = held_by.balance.stiffness
        message = f"joint '{name}': springs of {stiffness:.3g} N·m/rad carry its part, as of a {kind.range.kind}"
        notes.info("counterbalanced", message, joint=name, value=stiffness)
    if held_by.cut:
        message = (
            f"joint '{name}': friction that holds it, {held_by.wanted:.3g}, set to {held_by.friction:.3g}: with more a "
            "hand could not move it, or it would tip or slide; where contacts are stiffer than friction it may creep"
        )
        notes.info("friction_handled", message, joint=name, value=held_by.wanted, limit=held_by.friction)


def report_plain_spring(joint: JointPhysics, settings: PhysicsSettings, notes: Notes) -> None:
    """Add a finding where the URDF has a lighter spring than the joint, or none: it holds no armature to bear it."""
    stiffness, _ = plain_spring(joint, settings)
    if stiffness == joint.stiffness:
        return
    written = f"{stiffness / joint.stiffness:.2g} of it" if stiffness > 0.0 else "none"
    message = (
        f"joint '{joint.name}': its part bears its spring with an armature of {joint.armature:.3g} alone, which no "
        f"URDF holds: the URDF has {written}; overlay.json, load.py, MJCF and USD have it whole"
    )
    notes.info("spring_not_in_urdf", message, joint=joint.name, value=joint.stiffness, limit=stiffness)


def report_effort(joint: JointPhysics, stated: float | None, settings: PhysicsSettings, notes: Notes) -> None:
    """Add a finding where the file's effort limit (``stated``, N·m or N) is less than what moves the joint takes."""
    needed = effort_limit(stated, joint, settings)
    if stated and stated < needed:
        message = f"joint '{joint.name}': its effort limit of {stated:.3g} is raised to {needed:.3g}, which moves it"
        notes.info("effort_raised", message, joint=joint.name, value=stated, limit=needed)


def report_changes(name: str, moved: JointLoad, terms: JointTerms, holds: bool, notes: Notes) -> None:
    """Add a finding for every term that a bound changed and for every wish that is not met."""
    units = ("N·s/m", "N", "N/m") if moved.prismatic else ("N·m·s/rad", "N·m", "N·m/rad")
    bears = f"what its {moved.least:.3g} {'kg' if moved.prismatic else 'kg·m²'} bear at the time step"
    why = {
        "damping": f"{bears}, and a spring needs",
        "friction": "what holds it where it is placed" if holds else "its bound",
        "stiffness": bears,
    }
    for kind, term, unit in zip(why, (terms.damping, terms.friction, terms.stiffness), units, strict=True):
        if visibly_changed(term):
            message = f"joint '{name}': {kind} {term.replaced:.3g} {unit} set to {term.value:.3g}: {why[kind]}"
            notes.info(f"{kind}_bounded", message, joint=name, value=term.replaced, limit=term.value)
    for miss in terms.unmet:
        unit = "s" if miss.wish != "stops_within" else "m" if moved.prismatic else "rad"
        instead = "" if miss.achieved is None else f" is {miss.achieved:.3g} {unit}"
        message = f"joint '{name}': {miss.wish} of {miss.asked:.3g} {unit}{instead or ' does not apply'}: {miss.why}"
        notes.info(f"{miss.wish}_unmet", message, joint=name, value=miss.asked, limit=miss.achieved)


def visibly_changed(term: Term) -> bool:
    """Whether a bound replaced the term by something visibly different."""
    return term.replaced is not None and abs(term.replaced - term.value) > 1e-3 * max(abs(term.value), 1e-12)
