"""Facts told about an object: one mapping from its features, for the prompts, the prior and the checks."""

from collections.abc import Mapping

from asset2sim.guidance.object_info import ObjectInfo
from schemas.base import Vector3
from schemas.features import Features, JointFeatures, LinkFeatures

NO_BOX: Vector3 = (0.0, 0.0, 0.0)
SIGNIFICANT_DIGITS = 5
"""Digits kept of every number in a prompt: beyond what a model can use, and a third of the tokens of a double."""


def object_facts(features: Features) -> dict[str, object]:
    """The object as JSON values, at the authored scale: lengths in m, positions in rad or m. A link without geometry is
    stated without a centre."""
    return {
        "asset_id": features.asset_id,
        "category": features.category,
        **({"lengths": features.metric} if features.metric else {}),
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
