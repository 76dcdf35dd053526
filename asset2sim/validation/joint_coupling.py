"""Damping and stiffness of joints that move each other, bounded together by the time step."""

from collections.abc import Mapping, Sequence

from asset2sim.physics.mass_matrix import JointSpace
from schemas.finding import Notes
from schemas.overlay import JointPhysics
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source


def bound_together(
    joints: list[JointPhysics],
    rests: Mapping[str, float],
    spaces: Sequence[JointSpace],
    settings: PhysicsSettings,
    notes: Notes,
) -> tuple[JointPhysics, ...]:
    """Scale down all damping, or all stiffness, where the coupled joints would be unstable at the time step.

    Explicit damping is stable while Δt times the largest eigenvalue of M⁻¹D is below 2, a spring while Δt² times that
    of M⁻¹K is below 4; before, each joint was bounded alone. A spring keeps the force with which it presses at rest.
    Springs with an armature keep their stiffness: the armature grows instead, until it bears the spring alone. It does
    not count for damping, since a URDF's reader knows the damping and not the armature.
    """
    step = settings.coarse_timestep_s
    damping = {joint.name: joint.damping for joint in joints}
    fastest = max(space.fastest_decay(damping) for space in spaces)
    largest = 2.0 * settings.max_damping_step / step
    if fastest > largest:
        factor = largest / fastest
        message = (
            f"all joint damping scaled by {factor:.3g}: together the joints decay at {fastest:.3g} 1/s, more than the "
            "time step bears"
        )
        notes.info("damping_coupled", message, value=fastest, limit=largest)
        joints = [
            joint.model_copy(update={"damping": joint.damping * factor, "damping_source": Source.RULE})
            for joint in joints
        ]
    largest = 2.0 * settings.max_stiffness_step / step**2
    fastest = fastest_spring(joints, spaces)
    if fastest > largest:
        joints = [
            joint.model_copy(update={"armature": max(joint.armature, joint.stiffness / largest)})
            if joint.armature > 0.0
            else joint
            for joint in joints
        ]
        fastest = fastest_spring(joints, spaces)
    if fastest > largest:
        factor = largest / fastest
        message = (
            f"all joint stiffness scaled by {factor:.3g}: together the springs drive the joints at {fastest:.3g} 1/s², "
            "more than the time step bears"
        )
        notes.info("stiffness_coupled", message, value=fastest, limit=largest)
        joints = [with_softer_spring(joint, factor, rests[joint.name]) for joint in joints]
    return tuple(joints)


def fastest_spring(joints: Sequence[JointPhysics], spaces: Sequence[JointSpace]) -> float:
    """The largest eigenvalue of M⁻¹ K over these poses, the joints' armature in M, 1/s²."""
    stiffness = {joint.name: joint.stiffness for joint in joints}
    armature = {joint.name: joint.armature for joint in joints}
    return max(space.geared(armature).fastest_decay(stiffness) for space in spaces)


def with_softer_spring(joint: JointPhysics, factor: float, rest: float) -> JointPhysics:
    """The joint with its spring's stiffness multiplied, and the same force at ``rest`` (rad or m)."""
    if joint.stiffness == 0.0:
        return joint
    reference = rest + (joint.spring_reference - rest) / factor
    changes = {"stiffness": joint.stiffness * factor, "stiffness_source": Source.RULE, "spring_reference": reference}
    return joint.model_copy(update=changes)
