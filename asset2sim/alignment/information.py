"""A record's features as the parser of guidance wants them; no prompt and no answer is looked at."""

from asset2sim.alignment.shape import closed_size, link_centers
from asset2sim.priors.information import JointInfo, LinkInfo, ObjectInfo
from schemas.base import Vector3
from schemas.features import Features, JointFeatures, LinkFeatures


def object_info(features: Features) -> ObjectInfo:
    """The object at the authored scale: lengths in m, positions in rad or m."""
    centers = link_centers(features)
    return ObjectInfo(
        asset_id=features.asset_id,
        category=features.category,
        size_m=features.rest_size,
        size_closed_m=closed_size(features),
        links=tuple(_link(link, centers.get(link.name, (0.0, 0.0, 0.0))) for link in features.links),
        joints=tuple(_joint(joint) for joint in features.movable_joints),
        edges=tuple((joint.parent, joint.child) for joint in features.joints),
    )


def _link(link: LinkFeatures, center: Vector3) -> LinkInfo:
    return LinkInfo(
        name=link.name,
        label=link.label,
        box_m=link.box_size,
        center_m=center,
        volume_m3=link.volume_m3,
        hull_volume_m3=link.hull_volume_m3,
        volume_source=link.volume_source.value,
        area_m2=link.area_m2,
        materials=link.materials,
    )


def _joint(joint: JointFeatures) -> JointInfo:
    limits = [limit for limit in (joint.lower, joint.upper) if limit is not None]
    turns = joint.type == "continuous"
    return JointInfo(
        name=joint.name,
        type=joint.type,
        parent=joint.parent,
        child=joint.child,
        axis=joint.axis_in_root,
        lower=None if turns else min(limits, default=None),
        upper=None if turns else max(limits, default=None),
        closed=joint.closed or 0.0,
        open=joint.open or 0.0,
        open_confidence=joint.openness_confidence,
    )
