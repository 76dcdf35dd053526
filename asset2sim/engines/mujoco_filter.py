"""MuJoCo's filter of contacts between related links, for an object whose root is held to the world."""

import mujoco


def exclude_related(spec: mujoco.MjSpec) -> None:
    """Exclude the contacts that MuJoCo filters where the root is free and keeps where it is held.

    MuJoCo takes links without a joint between them for one body, and filters contacts within a body and with the body
    that it is jointed to; not so where that body is welded to the world. The pairs that it would otherwise filter are
    excluded by name.
    """
    held: list[mujoco.MjsBody] = []
    jointed: list[mujoco.MjsBody] = []
    collect(spec.worldbody, held, jointed)
    for child in jointed:
        for parent in held:
            spec.add_exclude(bodyname1=parent.name, bodyname2=child.name)


def collect(body: "mujoco.MjsBody", held: "list[mujoco.MjsBody]", jointed: "list[mujoco.MjsBody]") -> None:
    """Sort what hangs on a body that is welded to the world: welded too, or one joint away with what that bears."""
    for child in body.bodies:
        if child.joints:
            jointed.extend(welded(child))
        else:
            held.append(child)
            collect(child, held, jointed)


def welded(body: "mujoco.MjsBody") -> "list[mujoco.MjsBody]":
    """The body and what hangs on it without a joint."""
    return [body, *(inner for child in body.bodies if not child.joints for inner in welded(child))]
