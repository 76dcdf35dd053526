"""The numbers of a URDF: every one that a reader needs is there, is a number, and is one that can be computed with."""

import math
from functools import partial
from pathlib import Path

from lxml.etree import _Element as Element

from schemas.errors import AssetError
from schemas.finding import Finding
from schemas.vocabulary import FailureMode, Severity, Stage

PARTS = ("link", "joint", "material")
"""Tags of the elements of a URDF whose numbers are checked."""
LARGEST = 1e7
"""Largest length, m, and angle, rad, taken for such: a metre in micrometres is 1e6, and larger ones drown all else."""
LARGEST_LIMIT = 1e20
"""Largest other number: limits of 1e16 and the like stand for none."""
BIAS = ("bias_slope", "bias_none_at", "bias_least", "bias_most", "bias_period")
"""Attributes of a mechanism's effort (``schemas.mechanism.Bias``)."""
DYNAMICS = ("damping", "friction", "spring_stiffness", "spring_reference", "armature", "geared_stiffness",
            "geared_reference", *BIAS)  # fmt: skip
COUNTS: dict[str, dict[str, tuple[int, ...]]] = {
    "origin": {"xyz": (3,), "rpy": (3,)},
    "axis": {"xyz": (3,)},
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), (1,)),
    "dynamics": dict.fromkeys(DYNAMICS, (1,)),
    "safety_controller": dict.fromkeys(("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"), (1,)),
    "calibration": dict.fromkeys(("rising", "falling"), (1,)),
    "color": {"rgba": (3, 4)},
}
"""Element → attribute → how many numbers it holds. Those of an inertial are left to extraction, which goes on without
it, those of a mimic and of shapes to what drops them."""
CONTACTS = ("lateral_friction", "restitution", "mu1")
"""Elements of a link's contacts that are read, Bullet's and Gazebo's."""
SIZES = {"box": {"size": 3}, "sphere": {"radius": 1}, "cylinder": {"radius": 1, "length": 1},
         "capsule": {"radius": 1, "length": 1}}  # fmt: skip
"""Shape → the attributes that it must state, and how many positive numbers each holds."""
THINNEST_M, THINNEST_SHARE = 1e-4, 1e-3
"""Least thickness, m, of a box or disc that engines collide with as with any other, and the share of its longest edge
up to which one that is thinner is a plate: one of 0.01 mm by 2 m rocks on a floor for good."""
info = partial(Finding, stage=Stage.EXTRACT, severity=Severity.INFO)
warning = partial(Finding, stage=Stage.EXTRACT, severity=Severity.WARNING)
"""Findings on a URDF, by how much they matter."""


def check_numbers(path: Path, robot: Element) -> None:
    """Refuse attributes that hold no number, another count of them, or one that is not finite or too large. Raises
    AssetError, which names the element: invalid_joint_configuration of a joint, else unreadable_asset."""
    for part in robot.iterchildren(*PARTS):
        for element in part.iter(*COUNTS):
            parent = element.getparent()
            if parent is not None and parent.tag == "inertial":
                continue
            for key, counts in COUNTS[str(element.tag)].items():
                text = element.get(key)
                largest = LARGEST if element.tag in ("origin", "axis") else LARGEST_LIMIT
                if text is not None and (problem := problem_of(text, counts, largest)) is not None:
                    raise bad_number(
                        path, part, f"<{element.tag} {key}='{shortened_text(text)}'> of '{part.get('name')}'", *problem
                    )


def bad_number(path: Path, part: Element, what: str, code: str, problem: str) -> AssetError:
    """The error for an attribute of a link or a joint."""
    joint, name = part.tag == "joint", str(part.get("name"))
    mode = FailureMode.INVALID_JOINT_CONFIGURATION if joint else FailureMode.UNREADABLE_ASSET
    owner = {"joint": name} if joint else {"link": name} if part.tag == "link" else {}
    return AssetError(mode, code, f"{path.name}: {what} {problem}", **owner)


def problem_of(text: str, counts: tuple[int, ...], largest: float) -> tuple[str, str] | None:
    """A finding's code and what is wrong with an attribute's numbers; None where they can be used."""
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        point = ", with a point and no comma" if "," in text else ""
        return "not_a_number", f"is not a number: state one{point}" if counts == (
            1,
        ) else f"are not numbers: state them{point}"
    if len(values) not in counts:
        wanted = " or ".join(map(str, counts))
        return "not_a_number", f"holds {len(values)} numbers: state {wanted}"
    if not all(math.isfinite(value) for value in values):
        return "not_finite", "is not finite: state a number"
    if max(map(abs, values)) > largest:
        return "too_large", f"is larger than {largest:g}: state metres and radians"
    return None


def shortened_text(text: str) -> str:
    """An attribute's text for a message."""
    return text if len(text) <= 60 else f"{text[:60]}…"


def drop_unusable_contacts(robot: Element) -> list[Finding]:
    """Remove friction and restitution of contacts that are not one finite number; a finding for each."""
    findings = []
    for item in list(robot.iter(*CONTACTS)):
        text, above = item.get("value", item.text or ""), item.getparent()
        problem = problem_of(text, (1,), LARGEST_LIMIT)
        if problem is not None and above is not None:
            name = str(above.get("reference") or getattr(above.getparent(), "attrib", {}).get("name"))
            message = f"<{item.tag}> '{shortened_text(text)}' of link '{name}' {problem[1]}; it is left out"
            findings.append(warning(code="contact_number", message=message, link=name))
            above.remove(item)
    return findings


def drop_unusable_shapes(path: Path, robot: Element) -> list[Finding]:
    """Remove visuals and collisions whose shape has no size, or whose mesh has a scale that leaves nothing of it; a
    finding for each. Raises AssetError (missing_mesh) where nothing is left of a link that was to have a size: one
    whose every shape is of size 0, as people write it who had to write something, is a frame."""
    findings = []
    for link in robot.findall("link"):
        points = True
        for item in [*link.findall("visual"), *link.findall("collision")]:
            shape = item.find("geometry/*")
            problem = None if shape is None else problem_of_shape(shape)
            if problem is None:
                continue
            name = str(link.get("name"))
            message = f"link '{name}': {problem}; its {item.tag} is left out"
            code = "mesh_scale" if shape is not None and shape.tag == "mesh" else "shape_size"
            findings.append(warning(code=code, message=message, link=name))
            link.remove(item)
            points = points and is_point(shape)
            if link.find("visual") is None and link.find("collision") is None and not points:
                message = f"{path.name}: {message}, and nothing is left of the link"
                raise AssetError(FailureMode.MISSING_MESH, code, message, link=name)
    return findings


def thicken_plates(robot: Element) -> list[Finding]:
    """Give collision boxes and discs that are thinner than engines bear the least thickness; a finding for each."""
    findings = []
    for link in robot.findall("link"):
        for shape in (*link.iterfind("collision/geometry/box"), *link.iterfind("collision/geometry/cylinder")):
            key = "size" if shape.tag == "box" else "length"
            edges = [float(word) for word in shape.get(key, "").split()]
            longest = max(edges) if shape.tag == "box" else 2.0 * float(shape.get("radius", "0"))
            least = min(THINNEST_M, THINNEST_SHARE * longest)
            if min(edges) >= least:
                continue
            shape.set(key, " ".join(f"{max(edge, least):.9g}" for edge in edges))
            name = str(link.get("name"))
            message = f"link '{name}': its {shape.tag} of {min(edges):.3g} m collides as one {least:.3g} m thick"
            findings.append(warning(code="sheet_thickened", message=message, link=name, value=min(edges), limit=least))
    return findings


def is_point(shape: Element | None) -> bool:
    """Whether every length that a shape states is 0."""
    stated = [] if shape is None else [shape.get(key, "").split() for key in SIZES.get(str(shape.tag), {})]
    words = [word for texts in stated for word in texts]
    return bool(words) and all(problem_of(word, (1,), LARGEST) is None and float(word) == 0.0 for word in words)


def problem_of_shape(shape: Element) -> str | None:
    """The fault in the size of a shape or the scale of a mesh, with the remedy; None where they can be used."""
    if shape.tag == "mesh":
        text = shape.get("scale")
        words = (text or "").split()
        if not text or not words or (problem_of(text, (1, 3), math.inf) is None and all(map(float, words))):
            return None
        named = f"mesh '{shortened_text(str(shape.get('filename')))}' has the scale '{shortened_text(text)}'"
        return f"{named}: state one number or three, finite and none of them 0"
    for key, count in SIZES.get(str(shape.tag), {}).items():
        text = shape.get(key, "")
        if problem_of(text, (count,), LARGEST) is not None or min(map(float, text.split())) <= 0.0:
            wanted = "a number above 0" if count == 1 else f"{count} numbers above 0"
            return f"its <{shape.tag}> has the {key} '{shortened_text(text)}': state {wanted}, in metres"
    return None


INERTIALS = {"origin": {"xyz": 3, "rpy": 3}, "mass": {"value": 1},
             "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1)}  # fmt: skip


def drop_unusable_inertials(robot: Element) -> list[Finding]:
    """Remove inertials that hold no numbers, or ones that are not finite or too large; a finding for each."""
    findings = []
    for link in robot.findall("link"):
        for inertial in link.findall("inertial"):
            stated = [
                (element, key, str(element.get(key)), count)
                for element in inertial.iter(*INERTIALS)
                for key, count in INERTIALS[str(element.tag)].items()
                if element.get(key) is not None
            ]
            problems = ((*item[:3], problem_of_inertial(*item)) for item in stated)
            element, key, text, problem = next((item for item in problems if item[3]), (None, "", "", None))
            if element is None:
                continue
            name = str(link.get("name"))
            term = f"<{element.tag} {key}='{shortened_text(text)}'>"
            message = f"link '{name}': its inertial counts as none, since {term} {problem}"
            findings.append(warning(code="inertial_unusable", message=message, link=name))
            link.remove(inertial)
    return findings


def problem_of_inertial(element: Element, key: str, text: str, count: int) -> str | None:
    """The fault of an attribute of an inertial, with the remedy; None where it can be used."""
    found = problem_of(text, (count,), LARGEST)
    if found is None and element.tag == "mass" and float(text) < 0.0:
        return "is negative: state kilograms"
    return found[1] if found else None


def name_files(robot: Element) -> None:
    """Give meshes and textures that name no file an empty name."""
    for part in robot.iterchildren(*PARTS):
        for element in part.iter("mesh", "texture"):
            element.set("filename", element.get("filename", ""))
