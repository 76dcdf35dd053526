"""Limits that are stated in degrees, as radians."""

import math

from schemas.features import JointFeatures
from schemas.finding import Finding
from schemas.vocabulary import Severity, Stage

LONGEST_RANGE_RAD = 3.0 * 2.0 * math.pi
"""Longest range that a hinge with limits is believed to have, rad: a screw cap comes off after three turns. Read as
degrees, it is 19: hinges that open less are not told apart."""
LARGEST_DEGREES = 720.0
"""Largest limit that may be degrees; beyond it, the number stands for no limit at all."""


def limits_in_radians(joint: JointFeatures) -> tuple[JointFeatures, Finding | None]:
    """A hinge whose range is longer than any hinge's, with its limits read as degrees; otherwise as it is."""
    if joint.type != "revolute" or joint.lower is None or joint.upper is None:
        return joint, None
    range_rad, largest = abs(joint.upper - joint.lower), max(abs(joint.lower), abs(joint.upper))
    if range_rad <= LONGEST_RANGE_RAD or largest > LARGEST_DEGREES:
        return joint, None
    lower, upper = math.radians(joint.lower), math.radians(joint.upper)
    finding = Finding(
        stage=Stage.EXTRACT,
        severity=Severity.WARNING,
        code="limits_in_degrees",
        message=f"joint '{joint.name}': limits {joint.lower:.4g} to {joint.upper:.4g} rad are "
        f"{range_rad / math.tau:.3g} turns; read as degrees, {lower:.4g} to {upper:.4g} rad: state radians",
        joint=joint.name,
        value=range_rad,
        limit=LONGEST_RANGE_RAD,
    )
    return joint.model_copy(update={"lower": lower, "upper": upper}), finding
