"""Validation: whatever a model says, the overlay that comes out is complete and an engine can simulate it."""

import math
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.assets.extract import Extraction
from asset2sim.physics.inertia import tensor_of
from asset2sim.validation.validate import validate
from schemas.finding import Finding
from schemas.overlay import JointPhysics, JointProposal, LinkProposal, Overlay, PhysicsOverlay
from schemas.settings import PhysicsSettings
from schemas.support import Support, SupportKind
from schemas.vocabulary import Severity, Source, Stage, VolumeSource
from tests.assets import RAW, cabinet, joint, link, near, read, robot, shape, written

PHYSICS = PhysicsSettings()
LINKS = ("body", "lid", "drawer", "knob")
JOINTS = ("lid_hinge", "drawer_slide", "knob_turn")
STEP = PHYSICS.coarse_timestep_s
G = 9.81


FOLDER = tempfile.TemporaryDirectory()
"""Where it is read from: what a press meets is looked for in its files."""


@cache
def thing() -> Extraction:
    return read(written(Path(FOLDER.name) / "cabinet", cabinet()))


def checked(
    overlay: Overlay, item: Extraction | None = None, support: Support | None = None
) -> tuple[PhysicsOverlay, tuple[Finding, ...]]:
    return validate(item or thing(), overlay, Source.MODEL, 0.5, PHYSICS, support)


def find(findings: tuple[Finding, ...], code: str) -> list[Finding]:
    return [finding for finding in findings if finding.code == code]


def physics(result: PhysicsOverlay, name: str) -> tuple[float, np.ndarray]:
    item = next(item for item in result.links if item.name == name)
    return item.mass_kg, tensor_of(item.inertia)


def numbers(value: object) -> list[float]:
    """Every number anywhere in a record's dump."""
    if isinstance(value, dict):
        return [number for item in value.values() for number in numbers(item)]
    if isinstance(value, list | tuple):
        return [number for item in value for number in numbers(item)]
    return [float(value)] if isinstance(value, int | float) else []


positive = st.floats(1e-9, 1e9)
finite = st.floats(-1e6, 1e6)
link_proposals = st.builds(
    LinkProposal,
    name=st.just("body"),
    density_kg_m3=st.none() | positive,
    hollow_factor=st.none() | st.floats(0.0, 1.0),
    mass_kg=st.none() | positive,
    com=st.none() | st.tuples(finite, finite, finite),
    inertia=st.none() | st.tuples(*[st.floats(-10.0, 10.0) | finite] * 6),
)
joint_proposals = st.builds(
    JointProposal,
    name=st.just("lid_hinge"),
    damping=st.none() | st.floats(0.0, 1e9),
    friction=st.none() | st.floats(0.0, 1e9),
    stiffness=st.none() | st.just(0.0) | positive,
    coast_s=st.none() | positive,
    spring_hz=st.none() | positive,
    spring_rest=st.none() | finite,
    press_start=st.none() | st.floats(0.0, 1e3),
    press_end=st.none() | st.floats(0.0, 1e3),
    holds=st.none() | st.booleans(),
)


@st.composite
def overlays(draw: st.DrawFn) -> Overlay:
    links = draw(st.lists(st.sampled_from(LINKS), unique=True))
    joints = draw(st.lists(st.sampled_from(JOINTS), unique=True))
    return Overlay(
        scale=draw(st.floats(1e-300, 1e300)),
        links=tuple(draw(link_proposals).model_copy(update={"name": name}) for name in links),
        joints=tuple(draw(joint_proposals).model_copy(update={"name": name}) for name in joints),
        initial_joint_positions=draw(st.dictionaries(st.sampled_from(JOINTS), finite)),
        asked=tuple(draw(st.lists(st.sampled_from(("scale", *JOINTS)), unique=True))),
    )


@settings(max_examples=150, deadline=None, derandomize=True)
@given(overlays())
def test_whatever_a_model_says_can_be_simulated(overlay: Overlay) -> None:
    result, findings = checked(overlay)
    assert tuple(item.name for item in result.links) == LINKS
    assert {item.name for item in result.joints} == set(JOINTS)
    assert np.isfinite(numbers(result.model_dump())).all()
    heaviest = max(item.mass_kg for item in result.links)
    for item in result.links:
        # Light only where more would be denser than any material, far lighter than the heaviest where nothing hangs on
        # it.
        carries = any(hinge.parent == item.name for hinge in thing().features.joints)
        least = max(PHYSICS.min_mass_kg, heaviest / PHYSICS.max_mass_ratio if carries else 0.0)
        shape = thing().features.link(item.name)
        volume = max(shape.volume_m3, shape.hull_volume_m3) * result.scale**3
        smallest = min(PHYSICS.smallest_mass_kg, PHYSICS.max_density_kg_m3 * volume)
        bound = least if volume == 0.0 else max(min(least, PHYSICS.raised_density_kg_m3 * volume), smallest)
        assert item.mass_kg >= bound * (1.0 - 1e-9), item.name
        moments = np.linalg.eigvalsh(tensor_of(item.inertia))
        assert moments[0] > 0.0 and moments[2] <= (moments[0] + moments[1]) * (1.0 + 1e-6), item.name
        low, high = (np.array(edge) * result.scale for edge in bounds(item.name))
        slack = 0.1 * (high - low) + 1e-9
        assert np.all(item.com >= low - slack) and np.all(item.com <= high + slack), item.name
    for part in result.joints:
        inertia = part.least_inertia
        assert 0.0 < inertia <= part.effective_inertia
        assert part.damping * STEP / inertia <= PHYSICS.max_damping_step * (1.0 + 1e-6), part.name
        spring = part.stiffness * STEP**2 / (inertia + part.armature)
        assert spring <= PHYSICS.max_stiffness_step * (1.0 + 1e-6), part.name
        if part.lower is not None and part.upper is not None:
            assert part.lower < part.upper and part.lower <= part.initial_position <= part.upper
        stops = [end for end in (part.lower, part.upper) if end is not None]
        if part.holds and all(abs(part.initial_position - end) > 2e-3 for end in stops):
            carried = 0.0 if part.bias is None else part.bias.at(part.initial_position)
            load = abs(part.gravity_load + carried)
            assert part.friction >= PHYSICS.least_hold_margin * load * (1.0 - 1e-9)
    longest = max(thing().features.rest_size) * result.scale
    assert 0.005 * (1.0 - 1e-9) <= longest <= 5.0 * (1.0 + 1e-9)
    # Everything that was left out is named.
    stated = {item.name for item in overlay.links if item.density_kg_m3 is not None or item.mass_kg is not None}
    assert {finding.link for finding in find(findings, "link_completed")} == set(LINKS) - stated
    given_joints = {item.name for item in overlay.joints}
    assert {finding.joint for finding in find(findings, "joint_completed")} == set(JOINTS) - given_joints
    assert all(finding.stage is Stage.VALIDATE and finding.severity is not Severity.ERROR for finding in findings)


def bounds(name: str) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    item = thing().features.link(name)
    return item.box_min, item.box_max


def test_mass_is_volume_times_density_times_hollow_factor_times_scale_cubed() -> None:
    proposal = LinkProposal(name="drawer", material="pine", density_kg_m3=500.0, hollow_factor=0.25)
    result, _ = checked(Overlay(scale=0.5, links=(proposal,)))
    item = next(item for item in result.links if item.name == "drawer")
    assert near(item.mass_kg, 0.5 * 0.4 * 0.2 * 0.5**3 * 500.0 * 0.25)
    assert near(item.volume_m3, 0.5 * 0.4 * 0.2 * 0.5**3)
    assert (item.density_kg_m3, item.hollow_factor, item.material) == (500.0, 0.25, "pine")
    assert (item.mass_source, item.inertia_source, item.com_source) == (Source.MODEL, Source.RULE, Source.RULE)


@pytest.mark.parametrize("scale", [0.2, 0.7, 1.0])
def test_twice_the_size_weighs_eight_times_and_turns_thirty_two_times_as_hard(scale: float) -> None:
    links = tuple(LinkProposal(name=name, density_kg_m3=2000.0, hollow_factor=0.5) for name in LINKS)
    small, _ = checked(Overlay(scale=scale, links=links))
    large, _ = checked(Overlay(scale=2.0 * scale, links=links))
    for one, two in zip(small.links, large.links, strict=True):
        assert near(two.mass_kg / one.mass_kg, 8.0)
        assert near(np.array(two.inertia), 32.0 * np.array(one.inertia), 1e-6)
        assert near(np.array(two.com), 2.0 * np.array(one.com))


def helpers() -> str:
    """A massless root, a massless link between two hinges, and a massless tip."""
    return robot(
        link("root"), link("body", shape("1 1 1")), link("between"), link("door", shape("0.1 0.6 0.8", xyz="0 0.3 0")),
        link("tip"),
        joint("weld", "fixed", "root", "body", xyz="0 0 0.5"),
        joint("yaw", "revolute", "body", "between", xyz="0.6 -0.3 0", axis="0 0 1", limit="0 1"),
        joint("pitch", "revolute", "between", "door", axis="0 1 0", limit="0 1"),
        joint("end", "fixed", "door", "tip", xyz="0 0.6 0"),
    )  # fmt: skip


def test_links_without_geometry_take_a_share_and_the_total_stays(tmp_path: Path) -> None:
    item = read(written(tmp_path, helpers()))
    links = (LinkProposal(name="body", mass_kg=10.0), LinkProposal(name="door", mass_kg=4.0))
    result, findings = checked(Overlay(scale=1.0, links=links), item)
    masses = {part.name: part.mass_kg for part in result.links}
    assert near(sum(masses.values()), 14.0)
    assert near(masses["root"], 1.0) and near(masses["body"], 9.0), "a tenth"
    assert near(masses["tip"], 0.4) and near(masses["between"], 0.36)
    assert near(masses["door"] + masses["between"] + masses["tip"], 4.0)
    taken = {finding.link: finding for finding in find(findings, "massless_link")}
    assert set(taken) == {"root", "between", "tip"} and near(taken["root"].value, 1.0)
    root, body = result.links[0], result.links[1]
    assert near(root.com, (0.0, 0.0, 0.5)) and near(body.com, (0.0, 0.0, 0.0)), "one centre, in two frames"
    assert near(np.array(root.inertia), np.array(body.inertia) / 9.0)
    assert root.volume_source is VolumeSource.NONE and root.mass_source is Source.RULE
    tip = result.links[4]
    assert near(tip.com, (0.0, -0.3, 0.0)), "the door's centre, seen from its edge"


def test_light_links_are_raised_and_ratios_bounded() -> None:
    links = (LinkProposal(name="body", mass_kg=50.0), LinkProposal(name="knob", mass_kg=1e-6))
    result, findings = checked(Overlay(scale=0.5, links=links))
    assert near(physics(result, "knob")[0], PHYSICS.min_mass_kg), "nothing hangs on it"
    assert [finding.link for finding in find(findings, "mass_raised")] == ["knob"]
    assert not find(findings, "mass_ratio")
    links = (LinkProposal(name="body", mass_kg=0.001), LinkProposal(name="lid", mass_kg=5.0))
    result, findings = checked(Overlay(scale=0.5, links=links))
    assert near(physics(result, "body")[0], 5.0 / 1000.0)
    assert [(finding.link, finding.limit) for finding in find(findings, "mass_ratio")] == [("body", 0.005)]


def test_a_proposed_inertia_or_centre_is_believed_only_if_plausible() -> None:
    plausible = LinkProposal(name="body", mass_kg=6.0, inertia=(2.0, 0.0, 0.0, 2.0, 0.0, 2.0), com=(0.0, 0.0, -0.4))
    result, findings = checked(Overlay(scale=1.0, links=(plausible,)))
    assert result.links[0].inertia == plausible.inertia and result.links[0].com == plausible.com
    assert result.links[0].inertia_source is Source.MODEL and result.links[0].com_source is Source.MODEL
    wild = plausible.model_copy(update={"inertia": (20.0, 0.0, 0.0, 20.0, 0.0, 20.0), "com": (0.0, 0.0, -0.7)})
    result, findings = checked(Overlay(scale=1.0, links=(wild,)))
    assert near(result.links[0].inertia, (1.0, 0.0, 0.0, 1.0, 0.0, 1.0)) and near(result.links[0].com, (0.0, 0.0, 0.0))
    assert {finding.code for finding in findings if finding.link == "body"} == {"inertia_implausible", "com_outside"}


def test_an_authored_inertial_is_kept_where_the_model_says_nothing(tmp_path: Path) -> None:
    stated = '<inertial><mass value="3"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    item = read(written(tmp_path, robot(link("a", shape("1 1 1") + stated))))
    result, findings = checked(Overlay(scale=0.5), item)
    assert (result.links[0].mass_kg, result.links[0].mass_source) == (3.0, Source.AUTHORED)
    assert not find(findings, "link_completed")


@pytest.mark.parametrize(("scale", "longest"), [(1e-6, 0.005), (1e6, 5.0)])
def test_an_absurd_scale_is_bounded(scale: float, longest: float) -> None:
    result, findings = checked(Overlay(scale=scale, asked=("scale",)))
    assert near(result.scale * max(thing().features.rest_size), longest) and result.scale_source is Source.RULE
    assert len(find(findings, "scale_bounded")) == 1


def test_scale_has_the_source_of_who_said_it() -> None:
    assert checked(Overlay(scale=0.5))[0].scale_source is Source.MODEL
    assert checked(Overlay(scale=0.5, asked=("scale",)))[0].scale_source is Source.USER


def lid(result: PhysicsOverlay) -> tuple[float, float, float]:
    part = next(part for part in result.joints if part.name == "lid_hinge")
    return part.friction, part.gravity_load, part.damping


def held(**said: object) -> tuple[PhysicsOverlay, tuple[Finding, ...]]:
    return checked(
        Overlay(
            scale=0.5,
            links=(LinkProposal(name="lid", mass_kg=2.0),),
            joints=(JointProposal.model_validate({"name": "lid_hinge", **said}),),
            initial_joint_positions={"lid_hinge": math.pi / 3.0 - 0.5},
            asked=("lid_hinge",),
        )
    )


def test_a_lid_that_must_hold_has_friction_over_its_load_where_it_is_asked_to_stand() -> None:
    result, findings = held(holds=True, friction=0.001)
    # The lid's centre is 0.2 m · 0.5 from its hinge, level at q = 0: the load is largest there, and it is not there.
    level = 2.0 * G * 0.2 * 0.5
    friction, load, _ = lid(result)
    assert near(abs(load), level * math.cos(math.pi / 3.0 - 0.5))
    # Twice the load, if the object, of little mass beside it, did not tip over before a hand moved the lid.
    assert PHYSICS.least_hold_margin * abs(load) < friction < PHYSICS.hold_margin * abs(load)
    (finding,) = [item for item in find(findings, "friction_bounded") if item.joint == "lid_hinge"]
    assert near((finding.value, finding.limit), (0.001, friction))
    (cut,) = [item for item in find(findings, "friction_handled") if item.joint == "lid_hinge"]
    assert near((cut.value, cut.limit), (PHYSICS.hold_margin * abs(load), friction))
    assert "it would tip or slide" in cut.message and "it may creep" in cut.message


def test_a_requested_open_state_is_held_where_it_is() -> None:
    friction, load, _ = lid(held()[0])
    assert near(friction, lid(held(holds=True, friction=0.001)[0])[0]) and friction > 1.25 * abs(load)


def test_a_lid_that_must_not_hold_falls() -> None:
    friction, load, _ = lid(held(holds=False)[0])
    assert friction < 0.01 * abs(load) and abs(load) > 0.5


def sprung(rest: float) -> JointPhysics:
    result, _ = held(spring_hz=2.0, spring_rest=rest, holds=False)
    return next(part for part in result.joints if part.name == "lid_hinge")


@pytest.mark.parametrize(("rest", "margin"), [(0.25, 1.0), (1.0, 1.5)])
def test_a_spring_carries_its_part_and_presses_it_on_a_stop(rest: float, margin: float) -> None:
    part = sprung(rest)
    assert near(part.stiffness, (4.0 * math.pi) ** 2 * part.effective_inertia)
    # The lid of 2 kg, its centre 0.1 m from the hinge, is level at zero.
    assert near(part.stiffness * (part.spring_reference - rest), margin * 2.0 * G * 0.1 * math.cos(rest), 1e-6)
    ratio = part.damping / (2.0 * math.sqrt(part.stiffness * part.effective_inertia))
    assert ratio >= PHYSICS.spring_damping_ratio * (1.0 - 1e-9) and part.friction == 0.0


def test_absolute_damping_is_bounded_by_what_it_damps() -> None:
    result, findings = held(damping=1e3)
    part = next(part for part in result.joints if part.name == "lid_hinge")
    assert near(part.damping, 0.5 * 60.0 * part.least_inertia, 1e-6) and part.damping_source is Source.RULE
    (finding,) = [item for item in find(findings, "damping_bounded") if item.joint == "lid_hinge"]
    assert finding.value == 1e3 and near(finding.limit, part.damping, 1e-6)


def test_joints_that_share_a_light_body_are_damped_less_together(tmp_path: Path) -> None:
    drawers = [f"drawer_{i}" for i in range(4)]
    urdf = robot(
        link("body", shape("1 1 1")),
        *(link(name, shape("0.2 0.2 0.2")) for name in drawers),
        *(joint(f"slide_{n}", "prismatic", "body", n, xyz="1 0 0", axis="1 0 0", limit="0 1") for n in drawers),
    )
    light, heavy = 1.0, 50.0
    links = (LinkProposal(name="body", mass_kg=light), *(LinkProposal(name=n, mass_kg=heavy) for n in drawers))
    joints = tuple(JointProposal(name=f"slide_{name}", damping=1e6) for name in drawers)
    proposal, item = Overlay(scale=1.0, links=links, joints=joints), read(written(tmp_path, urdf))
    carried = [Support(kind=kind, source=Source.USER) for kind in (SupportKind.FREESTANDING, SupportKind.FIXED)]
    result, findings = checked(proposal, item, carried[0])
    # Alike on one axis: M⁻¹ = 1/body + δ/drawer, and all four together decay at c (4/body + 1/drawer).
    (damping,) = {round(part.damping, 6) for part in result.joints}
    assert near(damping * (4.0 / light + 1.0 / heavy), 2.0 * PHYSICS.max_damping_step / STEP, 1e-6)
    assert len(find(findings, "damping_coupled")) == 1
    result, findings = checked(proposal, item, carried[1])
    assert not find(findings, "damping_coupled"), "a held body is moved by none"
    assert all(near(part.damping, PHYSICS.max_damping_step * heavy / STEP, 1e-6) for part in result.joints)


def test_a_felt_damping_is_inertia_over_the_coasting_time() -> None:
    result, _ = held(coast_s=0.4)
    part = next(part for part in result.joints if part.name == "lid_hinge")
    assert near(part.damping, part.effective_inertia / 0.4) and part.damping_source is Source.MODEL


def test_users_dynamics_are_theirs() -> None:
    overlay = Overlay(scale=0.5, joints=(JointProposal(name="lid_hinge", friction=0.5),), asked=("lid_hinge.dynamics",))
    assert next(part for part in checked(overlay)[0].joints if part.name == "lid_hinge").friction_source is Source.USER


def test_the_planted_inverted_limits_are_mended() -> None:
    result, findings = checked(Overlay(scale=0.2), read(RAW / "Box" / "planted_inverted_limits"))
    (part,) = result.joints
    assert near((part.lower, part.upper), (-0.2, 1.8)) and part.limits_source is Source.RULE
    assert [finding.joint for finding in find(findings, "limits_inverted")] == ["joint_0"]


def test_a_joint_without_a_range_is_not_among_the_movable_ones(tmp_path: Path) -> None:
    urdf = robot(
        link("a", shape("1 1 1")), link("b", shape("1 1 1")), link("c", shape("1 1 1")),
        joint("stuck", "prismatic", "a", "b", xyz="0 0 2", axis="0 0 1", limit="0.25 0.25"),
        joint("free", "revolute", "b", "c", xyz="0 0 2", axis="0 0 1", limit="0 1"),
    )  # fmt: skip
    result, findings = checked(Overlay(scale=1.0), read(written(tmp_path, urdf)))
    assert [part.name for part in result.joints] == ["free"]
    assert [finding.joint for finding in find(findings, "joint_locked")] == ["stuck"]


def test_the_least_inertia_is_that_of_the_worst_pose_of_all_joints(tmp_path: Path) -> None:
    """A mast turns with an arm that slides out on it: drawn in, it is far easier to turn."""
    urdf = robot(
        link("body", shape("1 1 1")), link("mast", shape("0.1 0.1 0.1")), link("arm", shape("0.1 0.1 0.1")),
        joint("turn", "revolute", "body", "mast", xyz="0 0 1", axis="0 0 1", limit="-1 1"),
        joint("out", "prismatic", "mast", "arm", axis="1 0 0", limit="0.5 2"),
    )  # fmt: skip
    links = tuple(LinkProposal(name=n, mass_kg=m) for n, m in (("body", 1e3), ("mast", 1.0), ("arm", 4.0)))
    joints = (JointProposal(name="turn", damping=1e3), JointProposal(name="out"))
    overlay = Overlay(scale=1.0, links=links, joints=joints, initial_joint_positions={"out": 2.0}, asked=("out",))
    part = checked(overlay, read(written(tmp_path, urdf)))[0].joints[0]
    cubes = (1.0 + 4.0) * 0.01 / 6.0
    assert part.effective_inertia == pytest.approx(cubes + 4.0 * 2.0**2, rel=0.2)
    # 4 kg at 0.5 m; the arm may slide and the body gives way, a little.
    assert part.least_inertia == pytest.approx(cubes + 4.0 * 0.5**2, rel=0.05)
    assert near(part.damping, 0.5 * 60.0 * part.least_inertia, 1e-6)


def test_springs_that_share_a_light_body_are_softened_together(tmp_path: Path) -> None:
    keys = [f"key_{i}" for i in range(4)]
    urdf = robot(
        link("body", shape("1 1 1")),
        *(link(name, shape("0.2 0.2 0.2")) for name in keys),
        *(joint(f"press_{name}", "prismatic", "body", name, xyz="0 0 2", axis="0 0 1", limit="-1 0") for name in keys),
    )
    light, heavy = 1.0, 50.0
    links = (LinkProposal(name="body", mass_kg=light), *(LinkProposal(name=name, mass_kg=heavy) for name in keys))
    joints = tuple(JointProposal(name=f"press_{name}", stiffness=1e6, spring_rest=0.0) for name in keys)
    result, findings = checked(Overlay(scale=1.0, links=links, joints=joints), read(written(tmp_path, urdf)))
    (stiffness,) = {round(part.stiffness, 4) for part in result.joints}
    assert near(stiffness * (4.0 / light + 1.0 / heavy), 2.0 * PHYSICS.max_stiffness_step / STEP**2, 1e-5)
    assert len(find(findings, "stiffness_coupled")) == 1
    for part in result.joints:  # each still presses its key on its stop with half its weight more than it weighs
        assert near(part.stiffness * part.spring_reference, 1.5 * heavy * G, 1e-5)


def test_a_tiny_part_on_a_heavy_one_gets_an_armature_and_keeps_its_mass() -> None:
    masses = (("body", 900.0), ("drawer", 900.0), ("lid", 900.0), ("knob", 1.0))
    links = tuple(LinkProposal(name=name, mass_kg=mass) for name, mass in masses)
    result, findings = checked(Overlay(scale=1.0, links=links))
    mass, inertia = physics(result, "knob")
    thick = np.linalg.eigvalsh(physics(result, "drawer")[1])[-1]
    assert mass == 1.0 and near(np.linalg.eigvalsh(inertia)[0], max(thick / PHYSICS.max_inertia_ratio, 0.01 / 6.0))
    assert not find(findings, "inertia_ratio"), "a knob of 0.1 m on a drawer of 0.5 m is within the ratio"
    tight = PHYSICS.model_copy(update={"max_inertia_ratio": 1e4})
    result, findings = validate(thing(), Overlay(scale=1.0, links=links), Source.MODEL, 0.5, tight)
    assert near(np.linalg.eigvalsh(physics(result, "knob")[1])[0], thick / 1e4)
    assert physics(result, "knob")[0] == 1.0
    assert [finding.link for finding in find(findings, "inertia_ratio")] == ["knob"]


def test_no_armature_puts_a_mass_farther_out_than_its_part_reaches() -> None:
    masses = (("body", 900.0), ("drawer", 900.0), ("lid", 900.0), ("knob", 1.0))
    links = tuple(LinkProposal(name=name, mass_kg=mass) for name, mass in masses)
    greedy = PHYSICS.model_copy(update={"max_inertia_ratio": 1e2})
    result, findings = validate(thing(), Overlay(scale=1.0, links=links), Source.MODEL, 0.5, greedy)
    # 1 kg on the faces of a cube of 0.1 m: a second moment of m (0.05 m)² along each axis, twice that about each.
    np.testing.assert_allclose(physics(result, "knob")[1], 2.0 * 1.0 * 0.05**2 * np.eye(3), rtol=1e-9, atol=1e-15)
    assert "knob" in [finding.link for finding in find(findings, "inertia_reach")]
