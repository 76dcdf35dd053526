"""Facts told about an object: one mapping from its features, for the prompts, the prior and the checks, and what the
synthesis is told beyond it: directions, sizes in centimetres, what each link would weigh, how each part moves and
falls, and where parts overlap as drawn."""

from collections.abc import Mapping, Sequence

import numpy as np

from asset2sim.guidance.link_colors import OTHERS, mark_names
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.models.motion_facts import joint_motions
from asset2sim.physics.arrays import Array, floats_of
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from schemas.base import Vector3
from schemas.features import Features, JointFeatures, LinkFeatures, RestOverlap
from schemas.vocabulary import VolumeSource

NO_BOX: Vector3 = (0.0, 0.0, 0.0)
SIGNIFICANT_DIGITS = 5
"""Digits kept of every number in a prompt: beyond what a model can use, and a third of the tokens of a double."""


def object_facts(features: Features) -> dict[str, object]:
    """The object as JSON values, authored scale: lengths in m, positions in rad or m; no centre without geometry."""
    return {
        "asset_id": features.asset_id,
        "category": features.category,
        **({"lengths": features.metric} if features.metric else {}),
        **({"made_to_hang": features.hangs} if features.hangs else {}),
        "size_m": features.rest_size,
        "size_closed_m": features.closed_size,
        "links": [
            _link(link, features) | (_stated_contact(link) if features.metric else {}) for link in features.links
        ],
        "joints": [_joint(joint) | (_stated(joint) if features.metric else {}) for joint in features.joints],
    }


def rounded_object_info(features: Features) -> ObjectInfo:
    """The object as a prompt tells it, with rounded numbers."""
    return ObjectInfo.from_json({key: rounded_floats(value) for key, value in object_facts(features).items()})


def object_info(features: Features) -> ObjectInfo:
    """The object with exact numbers."""
    return ObjectInfo.from_json(object_facts(features))


def rounded_floats(value: object, digits: int = SIGNIFICANT_DIGITS) -> object:
    """The value with every float in it rounded to this many significant digits."""
    if isinstance(value, float):
        return float(f"{value:.{digits}g}") + 0.0  # and no negative zero
    if isinstance(value, Mapping):
        return {key: rounded_floats(item, digits) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [rounded_floats(item, digits) for item in value]
    return value


def _link(link: LinkFeatures, features: Features) -> dict[str, object]:
    return {
        "name": link.name,
        "label": link.label,
        "joint_kind": link.joint_kind,
        "box_m": features.link_boxes.get(link.name, NO_BOX),
        "center_m": features.link_centers.get(link.name),
        "volume_m3": link.volume_m3,
        "hull_volume_m3": link.hull_volume_m3,
        "volume_source": link.volume_source.value,
        "area_m2": link.area_m2,
        "outer_m2": link.outer_m2,
        "materials": link.materials,
        "mass_kg": None if link.inertial is None else link.inertial.mass_kg,
    }


def _joint(joint: JointFeatures) -> dict[str, object]:
    limits = [limit for limit in (joint.lower, joint.upper) if limit is not None]
    return {
        "name": joint.name,
        "type": joint.type,
        "parent": joint.parent,
        "child": joint.child,
        # Rounding leaves 1e-17 where there is nothing.
        "axis": tuple(round(value, 9) + 0.0 for value in joint.axis_in_root),
        # Validation swaps inverted limits; a model is told the range that it will have.
        "lower": min(limits, default=None),
        "upper": max(limits, default=None),
        "closed": joint.closed,
        "open": joint.open,
        "open_confidence": joint.openness_confidence,
    }


def _stated_contact(link: LinkFeatures) -> dict[str, object]:
    """The coefficient of its contacts as a file in metres states it."""
    stated = None if link.contact is None else link.contact.friction
    return {} if stated is None else {"file_states": {"contact": stated}}


def _stated(joint: JointFeatures) -> dict[str, object]:
    """Damping, friction, spring and start as a file in metres states them: they stay where they are plausible."""
    terms = {"damping": joint.damping, "friction": joint.friction, "springs": joint.stiffness}
    stated = {name: value for name, value in terms.items() if value}
    stated |= {} if joint.start is None else {"start": joint.start}
    return {"file_states": stated} if stated else {}


LONGEST_CM = (5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 70.0, 110.0, 180.0)
"""Longest edges of the closed object for which its scale and its three edges are told, cm."""
FILLED = 0.85
"""Share of its hull from which a closed mesh shows no walls: it is drawn as a block."""
WATER_KG_M3 = 1000.0
ALIKE = ("opens", "gravity")
SHAPE = ("box_m", "center_m", "volume_m3", "hull_volume_m3", "volume_source", "area_m2", "outer_m2")
"""Facts on a link's shape, told where it has one."""


def synthesis_facts(features: Features, overlaps: Sequence[RestOverlap] = ()) -> dict[str, object]:
    """The object as JSON values, at the authored scale unless a key names a unit of its own. What is unknown or empty
    is left out; words that an earlier joint has too are given as ``moves_like``."""
    facts = object_facts(features)
    colors, motions = mark_names(features), joint_motions(features)
    poses = link_to_root(tree_of(features.joints), features.root, {})
    longest = max(features.closed_size)
    told: dict[str, object] = {"directions": axis_names(features)}
    for key, value in facts.items():
        told[key] = value
        if key == "size_closed_m":
            told["sizes"] = candidate_sizes(features)
    told["links"] = [
        without_empty(told_link | further_link_facts(link, colors.get(link.name), poses[link.name], longest))
        for told_link, link in zip(copied_mappings(facts["links"]), features.links, strict=True)
    ]
    joints, known = [], dict[tuple[str, str], str]()
    for item in copied_mappings(facts["joints"]):
        found = motions.get(str(item["name"]))
        if found is not None:
            words = (found.opens, found.gravity)
            same = known.setdefault(words, str(item["name"]))
            said = dict(zip(ALIKE, words, strict=True)) if same == item["name"] else {"moves_like": same}
            item |= {"origin_m": rounded_floats(np.round(found.origin, 6).tolist(), 3)} | said
        joints.append(without_empty(item))
    told["joints"] = joints
    told["overlaps_at_rest"] = [
        {
            "links": [item.link_a, item.link_b],
            "depth": "over 1 %" if item.depth_share is None else f"up to {100.0 * item.depth_share:.2g} %",
        }
        for item in overlaps
    ]
    return told


def axis_names(features: Features) -> str:
    """Which axes of the root frame are up, to the front and to the left."""
    front, left = (axis_name(axis) for axis in (features.front, np.cross(features.front, (0.0, 0.0, 1.0))))
    return f"up is +z, front is {front}, left (to someone who stands before it) is {left}"


def axis_name(axis: Sequence[float] | Array) -> str:
    """The axis that a direction is nearest to, with its sign."""
    index = int(np.argmax(np.abs(axis)))
    return f"{'+' if axis[index] > 0.0 else '-'}{'xyz'[index]}"


def candidate_sizes(features: Features) -> list[dict[str, object]]:
    """Candidate scales with the edges that they give to the closed object, cm."""
    longest = max(features.closed_size)
    if longest <= 0.0:
        return []
    x, y, z = np.asarray(features.closed_size) / longest
    edges = np.array([x, y, z] if abs(features.front[0]) >= abs(features.front[1]) else [y, x, z])
    return [
        {
            "scale": rounded_floats(edge / 100.0 / longest, 3),
            "depth_width_height_cm": rounded_floats((edges * edge).tolist(), 3),
        }
        for edge in LONGEST_CM
    ]


def further_link_facts(link: LinkFeatures, color: str | None, pose: Array, longest_m: float) -> dict[str, object]:
    """Further facts of a link; ``pose`` is its (4, 4) link-to-root transform at rest."""
    if not link.has_geometry or longest_m <= 0.0:
        return dict.fromkeys(SHAPE)
    center = link.center if link.volume_source is VolumeSource.SIGNED else link.shell_center
    told: dict[str, object] = {"volume_source": None, "area_m2": None, "volume_means": volume_means(link)}
    if color == OTHERS:
        return told
    return told | {
        "color": color,
        "com_m": rounded_floats(floats_of(apply(pose, np.asarray([center]))[0]), 3),
        "kg_at_longest_1m": {
            "solid": rounded_floats(WATER_KG_M3 * link.volume_m3 / longest_m**3, 3),
            "per_mm_of_wall": rounded_floats(WATER_KG_M3 * 1e-3 * link.outer_m2 / longest_m**2, 3),
        },
    }


def volume_means(link: LinkFeatures) -> str:
    """The solid whose volume a link's volume is."""
    filled = link.volume_m3 / link.hull_volume_m3 if link.hull_volume_m3 > 0.0 else 0.0
    if link.volume_source is VolumeSource.SIGNED:
        return "block" if filled >= FILLED else "material"
    return {VolumeSource.HULL: "outline", VolumeSource.MIXED: "part outline", VolumeSource.BOX: "sheet"}.get(
        link.volume_source, "none"
    )


def without_empty(item: dict[str, object]) -> dict[str, object]:
    """The mapping without what is unknown or empty."""
    return {key: value for key, value in item.items() if value is not None and value != () and value != ""}


def copied_mappings(value: object) -> list[dict[str, object]]:
    """Copies of the mappings in a list; empty for anything else."""
    return [dict(item) for item in value] if isinstance(value, list) else []
