"""Numbers of the user's own in place of a model's: checked against the asset before any model is asked, then exact."""

import difflib
import math
from collections.abc import Iterable
from functools import partial

from asset2sim.guidance.amounts import LARGEST_M, LEAST_SCALE, SMALLEST_M
from asset2sim.guidance.tables import materials
from asset2sim.validation.masses import link_mass, link_masses
from schemas.asset import Overrides, StatedPosition
from schemas.errors import AssetError, known_names
from schemas.features import Features, JointFeatures
from schemas.finding import Finding, Notes
from schemas.guidance import Guidance
from schemas.overlay import LinkProposal, Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import FailureMode, Severity, Source, Stage

SLACK_SHARE = 1e-3
"""How far outside its limits, as a share of the range, a stated position counts as one at the limit: people round."""
SURE = 0.3
"""Confidence in which end of a joint is closed, below which a share or a word of the user's is told with a warning."""
MASS_SHARE = 1e-3
"""How far the parts' masses together may be from the stated one."""
MASS_ROUNDS = 20
"""Rounds in which what bounded parts cannot take is given to the others."""
SAME_SCALE = 0.01
"""Share by which a model's scale may differ from the stated one, its masses still being those of the object."""

finding = partial(Finding, stage=Stage.SYNTHESIZE)


def check_overrides(features: Features, stated: Overrides) -> tuple[Finding, ...]:
    """Warnings on what is not clear in a user's numbers. Raises AssetError, which names file, line, column and the
    nearest name, for a joint or link that the asset does not have and a number that it cannot have."""
    told = list[Finding]()
    links = {link.name: link for link in features.links}
    for name in stated.materials:
        place = stated.place(f"material:{name}")
        if name not in links:
            raise _refused(f"{place}: there is no link '{name}'{_choices(name, links)}")
        if not links[name].has_geometry:
            raise _refused(f"{place}: link '{name}' has no geometry, so it is of no material", link=name)
    scale = stated.scale_of(features)
    if scale is not None:
        longest = scale * max(features.rest_size)
        if not SMALLEST_M <= longest <= LARGEST_M:
            column = "scale" if stated.scale is not None else "size_m"
            raise _refused(
                f"{stated.place(column)}: the object's longest edge would be {longest:.4g} m; objects are "
                f"{SMALLEST_M:g} to {LARGEST_M:g} m"
            )
    movable = {joint.name: joint for joint in features.movable_joints}
    for name, wanted in stated.joints.items():
        place = stated.place(f"joint:{name}")
        if name not in movable:
            fixed = any(joint.name == name for joint in features.joints)
            problem = f"joint '{name}' cannot move" if fixed else f"there is no joint '{name}'{_choices(name, movable)}"
            raise _refused(f"{place}: {problem}", joint=name if fixed else None)
        joint = movable[name]
        if joint.mimic is not None and joint.mimic.joint in stated.joints:
            raise _refused(f"{place}: joint '{name}' follows '{joint.mimic.joint}'; state one of them", joint=name)
        authored_position(joint, wanted, scale or 1.0, place, within=scale is not None or not joint.prismatic)
        if wanted.unit == "share" and joint.openness_confidence < SURE:
            message = (
                f"{place}: which end of joint '{name}' is closed is not clear; taken is {joint.closed:.4g} closed, "
                f"{joint.open:.4g} open: state the position itself where that is wrong"
            )
            told.append(finding(severity=Severity.WARNING, code="closed_end_unsure", message=message, joint=name))
    return tuple(told)


def stated_things(stated: Overrides) -> tuple[str, ...]:
    """Things that the user states as a number: ``scale``, and joints."""
    sized = stated.scale is not None or stated.size_m is not None
    return (*(("scale",) if sized else ()), *stated.joints)


def authored_position(
    joint: JointFeatures, wanted: StatedPosition, scale: float, place: str, *, within: bool = True
) -> float:
    """A stated position in rad, or m at the authored scale. Raises AssetError for a unit that the joint does not have
    and, unless ``within`` is False, for a position outside its limits."""
    value, unit = wanted.value, "m" if joint.prismatic else "rad"
    lower, upper, where = joint.lower, joint.upper, f"{place}: joint '{joint.name}'"
    if wanted.unit == "share":
        if lower is None or upper is None or joint.closed is None or joint.open is None:
            raise _refused(f"{where} turns for ever, neither open nor closed; state an angle in rad", joint=joint.name)
        return joint.closed + value * (joint.open - joint.closed)
    if wanted.unit == "deg" and not joint.prismatic:
        value = math.radians(value)
    elif wanted.unit not in ("", unit):
        moves = "slides: state m" if joint.prismatic else "turns: state rad, or deg"
        raise _refused(f"{where} {moves}, not {wanted.unit}", joint=joint.name)
    if joint.prismatic:
        value /= scale
    if lower is None or upper is None or not within:
        return value
    low, high = sorted((lower, upper))
    if not low - SLACK_SHARE * (high - low) <= value <= high + SLACK_SHARE * (high - low):
        factor = scale if joint.prismatic else 1.0
        # Limits that a user gives in rad are not degrees by chance.
        hint = "; degrees are written as 30deg" if not joint.prismatic and low <= math.radians(value) <= high else ""
        raise _refused(
            f"{where} goes from {factor * low:.4g} to {factor * high:.4g} {unit}, not to {factor * value:.4g}{hint}",
            joint=joint.name,
        )
    return min(max(value, low), high)


def overridden(
    features: Features, proposal: Overlay, stated: Overrides, settings: PhysicsSettings
) -> tuple[Overlay, tuple[Finding, ...]]:
    """The proposal with the user's numbers in place of its own, and a finding that lists them. ``asked`` names each by
    its path. Raises AssetError for a number that cannot be at the final scale."""
    asked, said = dict.fromkeys(proposal.asked), list[str]()
    scale = stated.scale_of(features)
    if scale is not None:
        proposal = _rescaled(proposal, scale)
        asked["scale"] = None
        said.append(f"scale {scale:.4g}")
    positions, joints = dict(proposal.initial_joint_positions), {joint.name: joint for joint in features.joints}
    for name, wanted in stated.joints.items():
        joint, place = joints[name], stated.place(f"joint:{name}")
        positions[name] = authored_position(joint, wanted, proposal.scale, place)
        asked |= dict.fromkeys((name,) if wanted.unit == "share" else (name, exact_path(name)))
        if joint.mimic is not None:  # The user's word for it goes before a model's for its leader.
            positions.pop(joint.mimic.joint, None)
            asked.pop(joint.mimic.joint, None)
        said.append(f"joint '{name}' at {positions[name] * (proposal.scale if joint.prismatic else 1.0):.4g}")
    links = {item.name: item for item in proposal.links}
    for name, material in stated.materials.items():
        links[name] = _made_of(links.get(name, LinkProposal(name=name)), material)
        asked[mass_path(name)] = None
        said.append(f"link '{name}' of {material}")
    change = proposal.mass_change
    if stated.mass_kg is not None:
        links = _weighing(features, links, proposal.scale, stated.mass_kg, settings, stated.place("mass_kg"))
        asked |= dict.fromkeys(map(mass_path, links))
        change = None
        said.append(f"mass {stated.mass_kg:.4g} kg")
    update = {"initial_joint_positions": positions, "links": tuple(links.values()), "mass_change": change}
    files = "; ".join(dict.fromkeys(stated.where.values()))
    message = f"the user's own numbers: {', '.join(said)} ({files})"
    told = finding(severity=Severity.INFO, code="overrides", message=message)
    return proposal.model_copy(update={**update, "asked": tuple(asked)}), (told,)


def words_with_scale(words: str | None, scale: float | None) -> str | None:
    """The user's words as a model is given them: with the scale that the user states as a number, so that walls,
    contents and forces are proposed for that size."""
    if scale is None or scale < LEAST_SCALE:
        return words
    return f"{(words or '').strip()} Scale it to {scale:.6f}.".strip()


def prompt_findings(guidance: Guidance) -> tuple[Finding, ...]:
    """A warning for each number of the guidance that no object can have, for what of it nothing has read, and for what
    contradicts itself."""
    said = [("prompt_number_unmet", f"'{item.words}' in the prompt cannot be met: {item.why}; the number is left out")
            for item in guidance.unmet]  # fmt: skip
    said += [("prompt_unread", f"'{item.words}' in the prompt is not read: {item.why}") for item in guidance.unread]
    said += [("prompt_contradiction", f"the prompt asks {item.words}: {item.why}") for item in guidance.contradictions]
    return tuple(finding(severity=Severity.WARNING, code=code, message=message) for code, message in said)


def exact_path(joint: str) -> str:
    """The name in ``Overlay.asked`` of a position that is stated as a number: the search leaves it as it is."""
    return f"initial_joint_positions.{joint}"


def mass_path(link: str) -> str:
    """The name in ``Overlay.asked`` of a link's mass that is the user's, or follows from the user's material."""
    return f"links.{link}.mass_kg"


def _rescaled(proposal: Overlay, scale: float) -> Overlay:
    """The proposal at another scale. Masses that a model states of the object at its own scale go with the volume."""
    ratio = scale / proposal.scale
    links = proposal.links
    if abs(ratio - 1.0) > SAME_SCALE:
        links = tuple(
            item.model_copy(
                update={
                    "mass_kg": item.mass_kg and item.mass_kg * ratio**3,
                    "com": item.com and tuple(ratio * value for value in item.com),
                    "inertia": None,
                }
            )
            for item in links
        )
    return proposal.model_copy(update={"scale": scale, "links": links})


def _made_of(item: LinkProposal, material: str) -> LinkProposal:
    """The link of another material: as thick as such walls are, of its density, and of no mass or inertia stated."""
    table = materials()
    known = table.get((item.material or "").strip().lower())
    thicker = table[material].wall_factor / known.wall_factor if known is not None else 1.0
    return item.model_copy(
        update={
            "material": material,
            "density_kg_m3": table[material].density_kg_m3,
            "wall_m": item.wall_m and item.wall_m * thicker,
            "hollow_factor": item.hollow_factor and min(item.hollow_factor * thicker, 1.0),
            "mass_kg": None,
            "inertia": None,
        }
    )


def _weighing(
    features: Features,
    links: dict[str, LinkProposal],
    scale: float,
    wanted: float,
    settings: PhysicsSettings,
    place: str,
) -> dict[str, LinkProposal]:
    """The links with masses in the proposal's proportions that come to ``wanted`` kg with all their bounds. Raises
    AssetError where bounds leave no such masses."""

    def weighed(items: dict[str, LinkProposal]) -> float:
        return sum(item.mass for item in link_masses(features, items, scale, Source.USER, settings, Notes()).values())

    solid = [link for link in features.links if link.has_geometry]
    # Of the parts alone: one without geometry takes of its neighbour's mass what it has.
    masses = {
        link.name: link_mass(link, links.get(link.name), scale, Source.USER, settings, Notes()).mass for link in solid
    }
    factor = wanted / sum(masses.values())
    for _ in range(MASS_ROUNDS):
        masses = {name: mass * factor for name, mass in masses.items()}
        links |= {name: _of_mass(links.get(name), name, mass, factor, settings) for name, mass in masses.items()}
        factor = wanted / weighed(links)
        if abs(factor - 1.0) <= MASS_SHARE:
            return links
    raise _refused(
        f"{place}: it cannot weigh {wanted:.4g} kg at its size, only {weighed(links):.4g} kg: parts are "
        f"{settings.smallest_mass_kg:g} kg at least and of at most {settings.max_density_kg_m3:g} kg/m³"
    )


def _of_mass(
    item: LinkProposal | None, name: str, mass: float, factor: float, settings: PhysicsSettings
) -> LinkProposal:
    item = item or LinkProposal(name=name)
    inside = tuple(part.model_copy(update={"mass_kg": part.mass_kg * factor}) for part in item.contents)
    # A mass alone would make a solid of what is proposed as hollow.
    bare = item.hollow_factor is None and item.wall_m is None
    hollow = settings.fallback_hollow_factor if bare and item.mass_kg is None else item.hollow_factor
    return item.model_copy(update={"mass_kg": mass, "contents": inside, "hollow_factor": hollow, "inertia": None})


def _choices(name: str, known: Iterable[str]) -> str:
    names = list(known)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    return (f"; did you mean '{near[0]}'?" if near else ";") + f" it has {known_names(names, 20) or 'none'}"


def _refused(message: str, *, link: str | None = None, joint: str | None = None) -> AssetError:
    return AssetError(FailureMode.NO_VALID_ESTIMATE, "override_impossible", message, link=link, joint=joint)
