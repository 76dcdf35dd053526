"""What an asset states that makes no physical sense is said, and nothing else is."""

from pathlib import Path

import pytest

from asset2sim.intake.authored_numbers import stated_findings
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Severity
from tasks.extract import validate_authored
from tests.assets import box_obj, joint, link, mesh, read, robot, shape, written

BOX_INERTIA = (0.0017, 0.0017, 0.0017)
"""About that of 1 kg in a cube of 0.1 m: m (b² + c²) / 12."""


def inertial(mass: float = 1.0, moments: tuple[float, float, float] = BOX_INERTIA, com: str = "0 0 0") -> str:
    values = " ".join(f'i{axis}="{value}"' for axis, value in zip(("xx", "yy", "zz"), moments, strict=True))
    return (
        f'<inertial><origin xyz="{com}"/><mass value="{mass}"/><inertia {values} ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def codes(
    folder: Path, own: str = "", axis: str = "0 0 1", limit: str = 'lower="0" upper="1" effort="10" velocity="1"',
    dynamics: str = 'damping="0.001" friction="0.001"', size: str = "0.1 0.1 0.1",
) -> set[str]:  # fmt: skip
    """The codes of what is said of two cubes, the second on a hinge."""
    hinge = joint(
        "hinge", "revolute", "a", "b", xyz="0.3 0 0", axis=axis, more=f"<limit {limit}/><dynamics {dynamics}/>"
    )
    text = robot(link("a", shape(size) + inertial()), link("b", shape("0.1 0.1 0.1") + (own or inertial())), hinge)
    found = stated_findings(read(written(folder, text)), PhysicsSettings())
    assert all(finding.severity is Severity.WARNING for finding in found)
    assert {finding.link or finding.joint for finding in found} <= {"a", "b", "hinge", None}
    return {finding.code for finding in found}


def test_a_joint_that_moves_nothing(tmp_path: Path) -> None:
    """A program is to add the door; of a joint of two axes the link between has no shape, and the next has one."""
    frame = link("frame", shape("0.1 0.1 0.1"))
    hinge = joint("hinge", "revolute", "frame", "door", limit="0 1")
    beyond = link("leaf", shape("0.1 0.1 0.1")) + joint("next", "revolute", "door", "leaf", limit="0 1")
    for name, more, said in (("bare", "", ["hinge"]), ("two", beyond, [])):
        item = read(written(tmp_path / name, robot(frame, link("door"), hinge, more)))
        found = stated_findings(item, PhysicsSettings())
        assert [finding.joint for finding in found if finding.code == "moves_nothing"] == said


@pytest.mark.parametrize(
    ("own", "code"),
    [
        (inertial(mass=0.0), "mass_zero"),
        (inertial(mass=1e3), "mass_unbelievable"),
        (inertial(mass=5e-4), "mass_unbelievable"),
        (inertial(moments=(1e-12, 1e-12, 1e-12)), "inertia_singular"),
        (inertial(moments=(-0.0017, 0.0017, 0.0017)), "inertia_singular"),
        (inertial(moments=(0.001, 0.001, 0.004)), "inertia_impossible"),
        (inertial(moments=(1.7, 1.7, 1.7)), "inertia_unbelievable"),
        (inertial(com="0 0 0.2"), "com_outside"),
        (" ", "inertial_missing"),
    ],
)
def test_a_link_that_no_body_is(tmp_path: Path, own: str, code: str) -> None:
    assert code in codes(tmp_path, own)


@pytest.mark.parametrize(
    ("dynamics", "code"),
    [
        ('damping="5"', "damping_unstable"),
        ('damping="-0.1"', "damping_negative"),
        ('friction="-0.1"', "friction_negative"),
        ('friction="1000"', "friction_sticks"),
        ('damping="0.01" spring_stiffness="1000"', "stiffness_unstable"),
        ('damping="0" spring_stiffness="1"', "spring_undamped"),
    ],
)
def test_dynamics_that_no_step_stands(tmp_path: Path, dynamics: str, code: str) -> None:
    assert code in codes(tmp_path, dynamics=dynamics)


@pytest.mark.parametrize(
    ("axis", "limit", "code"),
    [
        ("0 0 3", 'lower="0" upper="1"', "axis_not_unit"),
        ("0 0 1", 'lower="0" upper="1" effort="0"', "effort_zero"),
        ("0 0 1", 'effort="10"', "limits_missing"),
    ],
)
def test_a_joint_that_is_not_as_urdf_wants_it(tmp_path: Path, axis: str, limit: str, code: str) -> None:
    assert codes(tmp_path, axis=axis, limit=limit) == {code}


@pytest.mark.parametrize(
    ("part", "upper", "said"), [("drawer", 0.5, True), ("drawer", 0.43, False), ("lift", 0.5, False)]
)
def test_what_slides_out_is_said_of_drawers(tmp_path: Path, part: str, upper: float, said: bool) -> None:
    text = robot(
        link("case", shape("0.4 0.4 0.2")), link(part, shape("0.4 0.36 0.1", xyz="0 0 0.2")),
        joint("slide", "prismatic", "case", part, axis="1 0 0", limit=f"0 {upper}"),
    )  # fmt: skip
    found = [
        item
        for item in stated_findings(read(written(tmp_path, text)), PhysicsSettings())
        if item.code == "drawer_leaves"
    ]
    assert [(item.joint, item.value) for item in found] == [("slide", upper)] * said
    assert all(item.limit == pytest.approx(0.4) for item in found)


def test_lengths_in_millimetres(tmp_path: Path) -> None:
    assert "size_implausible" in codes(tmp_path, size="100 100 100")


def test_limits_in_degrees_are_read_as_degrees(tmp_path: Path) -> None:
    text = robot(
        link("a", shape("1 1 1")), link("b", shape("1 1 1")), link("c", shape("1 1 1")), link("d", shape("1 1 1")),
        joint("door", "revolute", "a", "b", axis="0 0 1", limit="0 90"),
        joint("cap", "revolute", "a", "c", axis="0 0 1", limit="0 12"),
        joint("valve", "revolute", "a", "d", axis="0 0 1", limit="-12.56 12.56"),
    )  # fmt: skip
    extraction = read(written(tmp_path, text))
    assert extraction.features.joint("door").upper == pytest.approx(1.5708, abs=1e-4)
    assert extraction.features.joint("cap").upper == 12.0
    assert extraction.features.joint("valve").upper == 12.56, "two turns either way, in radians"
    assert [(item.code, item.joint) for item in extraction.findings] == [("limits_in_degrees", "door")]


PANELS = {
    "back.obj": box_obj((-0.5, -0.02, -0.5), (0.5, 0.0, 0.5)),
    "left.obj": box_obj((-0.5, 0.0, -0.5), (-0.48, 0.5, 0.5)),
    "right.obj": box_obj((0.48, 0.0, -0.5), (0.5, 0.5, 0.5)),
}
"""A cabinet that is open to +y."""


def cabinet(folder: Path, collision: dict[str, str]) -> str:
    """Which collision shapes stand for a cabinet whose looks are its panels: their file names."""
    looks = "".join(mesh(name, "visual") for name in PANELS)
    text = robot(link("body", looks + "".join(mesh(name, "collision") for name in collision)))
    extraction = read(written(folder, text, {**PANELS, **{k: v for k, v in collision.items() if v}}))
    used = {part.reference for part in extraction.geometry["body"].parts}
    said = [item.code for item in extraction.findings if item.code == "collision_unlike_looks"]
    assert bool(said) == (used == set(PANELS))
    return " ".join(sorted(used))


@pytest.mark.parametrize(
    "collision",
    [
        {"hull.obj": box_obj((-0.5, -0.02, -0.5), (0.5, 0.5, 0.5))},
        {"mm.obj": box_obj((-500.0, -20.0, -500.0), (500.0, 0.0, 500.0))},
        {"flat.obj": box_obj((-0.5, 0.0, -0.5), (0.5, 0.0, 0.5)), "ok.obj": PANELS["left.obj"]},
        {"gone.obj": "", "ok.obj": PANELS["back.obj"]},
    ],
    ids=["filled", "millimetres", "flat", "missing"],
)
def test_collision_meshes_that_are_not_what_one_sees_give_way(tmp_path: Path, collision: dict[str, str]) -> None:
    assert cabinet(tmp_path, collision) == "back.obj left.obj right.obj"


def test_collision_meshes_that_fit_stay(tmp_path: Path) -> None:
    fine = {f"own_{name}": text for name, text in PANELS.items()}
    assert cabinet(tmp_path, fine) == "own_back.obj own_left.obj own_right.obj"


def test_a_panel_that_the_collision_leaves_out_collides_and_what_lies_in_the_others_does_not(tmp_path: Path) -> None:
    """Of a link that collides as its own looks: a screw within them needs no shape of its own, a panel does."""
    inner = {"screw.obj": box_obj((-0.1, -0.015, -0.1), (0.1, -0.005, 0.1))}
    looks = "".join(mesh(name, "visual") for name in (*PANELS, *inner))
    text = robot(link("body", looks + mesh("back.obj", "collision") + mesh("left.obj", "collision")))
    extraction = read(written(tmp_path, text, {**PANELS, **inner}))
    assert {part.reference for part in extraction.geometry["body"].parts} == set(PANELS)
    (said,) = (item.message for item in extraction.findings if item.code == "collision_unlike_looks")
    assert "'right.obj' is seen apart" in said
    assert extraction.features.links[0].shapes_doubt


def furniture(folder: Path, axis: str, limit: str | None, kind: str = "revolute") -> Path:
    """The cabinet with a door on its front, hinged at the left: about -z it would go in, about +z out."""
    more = "" if limit else '<limit effort="1" velocity="1"/>'
    text = robot(
        link("body", "".join(mesh(name) for name in PANELS)),
        link("door", mesh("door.obj")),
        joint("hinge", kind, "body", "door", xyz="-0.49 0.53 0", axis=axis, limit=limit, more=more),
    )
    return written(folder, text, {**PANELS, "door.obj": box_obj((0.0, -0.01, -0.45), (0.98, 0.01, 0.45))})


@pytest.mark.parametrize(("axis", "code"), [("0 0 1", None), ("0 0 -1", "axis_inverted")])
def test_a_door_that_goes_through_its_cabinet_is_turned_round(tmp_path: Path, axis: str, code: str | None) -> None:
    extraction = read(furniture(tmp_path, axis, "0 1.5"))
    mended, found = validate_authored(extraction, PhysicsSettings())
    assert [item.code for item in found if item.severity is Severity.WARNING] == ([code] if code else [])
    assert mended.features.joint("hinge").axis == (0.0, 0.0, 1.0)
    assert extraction.features.joint("hinge").axis[2] == float(axis.split()[2]), "the extraction itself stays"


def test_a_hinge_without_limits_gets_those_that_its_cabinet_leaves(tmp_path: Path) -> None:
    mended, found = validate_authored(read(furniture(tmp_path, "0 0 1", None)), PhysicsSettings())
    hinge = mended.features.joint("hinge")
    assert {"limits_missing", "limits_found"} <= {item.code for item in found}
    assert hinge.type == "revolute" and hinge.lower is not None and hinge.upper is not None
    assert -0.1 < hinge.lower <= 0.0 and 3.0 < hinge.upper < 5.0


@pytest.mark.parametrize(
    ("part", "limit", "kept"),
    [
        ("drawer", "0 1", (0.0, 0.34)),
        ("drawer", "-1 0", (-0.34, 0.0)),
        ("drawer", "0 0.45", None),
        ("lift", "0 1", None),
    ],
)
def test_a_drawer_stays_in_its_case(tmp_path: Path, part: str, limit: str, kept: tuple[float, float] | None) -> None:
    text = robot(
        link("case", shape("0.4 0.4 0.2")), link(part, shape("0.4 0.3 0.1")),
        joint("slide", "prismatic", "case", part, axis="1 0 0", limit=limit),
    )  # fmt: skip
    mended, found = validate_authored(read(written(tmp_path, text)), PhysicsSettings())
    slide = mended.features.joint("slide")
    assert (slide.lower, slide.upper) == pytest.approx(kept or tuple(map(float, limit.split())))
    assert ("travel_shortened" in {item.code for item in found}) is (kept is not None)


@pytest.mark.parametrize(("edge", "height"), [(0.01, 0.02), (0.1, 0.06)], ids=["small", "palm"])
def test_a_button_that_sinks_into_its_device_is_no_drawer(tmp_path: Path, edge: float, height: float) -> None:
    text = robot(
        link("device", mesh("device.obj")), link("key", mesh("key.obj")),
        joint("press", "prismatic", "device", "key", xyz=f"0 0 {0.1 + height / 2}", axis="0 0 -1",
              limit=f"0 {height}"),
    )  # fmt: skip
    files = {
        "device.obj": box_obj((-0.2, -0.2, -0.1), (0.2, 0.2, 0.1)),
        "key.obj": box_obj((-edge, -edge, -height / 2), (edge, edge, height / 2)),
    }
    mended, found = validate_authored(read(written(tmp_path, text, files)), PhysicsSettings())
    assert mended.features.joint("press").axis == (0.0, 0.0, -1.0)
    assert not [item for item in found if item.severity is Severity.WARNING]


def test_meshes_in_millimetres_on_joints_in_metres_are_told(tmp_path: Path) -> None:
    parts = (
        link("body", mesh("body.obj")), link("door", mesh("door.obj")),
        joint("hinge", "revolute", "body", "door", xyz="0.2 0 0", axis="0 0 1", limit="0 1"),
    )  # fmt: skip
    files = {"body.obj": box_obj((0, 0, 0), (400, 500, 600)), "door.obj": box_obj((0, 0, 0), (20, 500, 600))}
    settings = PhysicsSettings()
    told = stated_findings(read(written(tmp_path / "mm", robot(*parts), files)), settings)
    (finding,) = [item for item in told if item.code == "mesh_units"]
    assert 'scale="0.001 0.001 0.001"' in finding.message
    whole = [part.replace("0.2 0 0", "200 0 0") for part in parts]
    told = stated_findings(read(written(tmp_path / "all", robot(*whole), files)), settings)
    assert "mesh_units" not in {item.code for item in told} and "size_implausible" in {item.code for item in told}
