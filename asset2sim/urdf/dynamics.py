"""Reading joint dynamics back from a URDF: what an engine adapter must honour, whatever the engine's own parser
drops."""

from dataclasses import dataclass
from pathlib import Path

from lxml import etree


@dataclass(frozen=True)
class Dynamics:
    """Damping (N·m·s/rad or N·s/m), friction (N·m or N), stiffness (N·m/rad or N/m) and the spring's relaxed
    position."""

    damping: float
    friction: float
    stiffness: float
    spring_reference: float


def read_dynamics(urdf: Path) -> dict[str, Dynamics]:
    """Joint name → dynamics for every joint that is not fixed; absent attributes are 0."""
    terms: dict[str, Dynamics] = {}
    for joint in etree.parse(str(urdf)).getroot().findall("joint"):
        if joint.get("type") == "fixed":
            continue
        element = joint.find("dynamics")
        values = {} if element is None else element.attrib
        terms[str(joint.get("name"))] = Dynamics(
            damping=float(values.get("damping", 0.0)),
            friction=float(values.get("friction", 0.0)),
            stiffness=float(values.get("spring_stiffness", 0.0)),
            spring_reference=float(values.get("spring_reference", 0.0)),
        )
    return terms
