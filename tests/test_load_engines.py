"""``asset2sim.load`` in every engine that is installed, against closed forms. It needs numpy, pytest and the engine
alone, so it also runs where the project is not: ``pytest --noconftest tests/test_load_engines.py`` with any Python."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asset2sim.load import LoadError, describe, load

pytestmark = pytest.mark.system
NEEDS = {"pybullet": ("pybullet",), "mujoco": ("mujoco",), "sapien": ("sapien",), "drake": ("pydrake",),
         "genesis": ("genesis",), "newton": ("newton", "mujoco_warp")}  # fmt: skip
ENGINES = [
    pytest.param(
        name, marks=() if all(map(find_spec, modules)) else pytest.mark.skip(reason=f"{name} is not installed here")
    )
    for name, modules in NEEDS.items()
]
every_engine = pytest.mark.parametrize("engine", ENGINES)
TERMS = (
    "damping", "friction", "stiffness", "spring_reference", "armature", "initial_position", "gravity_load", "bias",
)  # fmt: skip
STEP = 1.0 / 240.0
G = 9.81
MASS, ARM = 0.5, 0.2
"""A ball of 0.5 kg, 0.2 m from its hinge."""
BALL_INERTIA = 2e-4
MOMENT = MASS * ARM**2 + BALL_INERTIA


def body(name: str, mass: float, com: str, moment: float, shape: str = "") -> str:
    inertia = f'ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"'
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/><inertia {inertia}/></inertial>'
        f"{shape}</link>"
    )


def box(size: str, xyz: str = "0 0 0") -> str:
    return f'<collision><origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry></collision>'


def written(
    folder: Path, links: str, joints: dict[str, dict[str, Any]], support: str = "fixed", asset_id: str = "thing"
) -> Path:
    """A refined folder: joints by name, each with kind, axis, parent and child, and terms that the overlay holds."""
    text, terms = "", []
    for name, said in joints.items():
        joint: dict[str, Any] = {"kind": "revolute", "axis": "0 1 0", "xyz": "0 0 0", "parent": "base"}
        joint = joint | {"lower": -3.0, "upper": 3.0} | said
        limit = f'<limit lower="{joint["lower"]}" upper="{joint["upper"]}" effort="100" velocity="100"/>'
        text += (
            f'<joint name="{name}" type="{joint["kind"]}"><origin xyz="{joint["xyz"]}"/><axis xyz="{joint["axis"]}"/>'
            f'<parent link="{joint["parent"]}"/><child link="{joint["child"]}"/>{limit}</joint>'
        )
        given: dict[str, Any] = dict.fromkeys(TERMS, 0.0) | {"effective_inertia": 1e-3, "holds": False, "bias": None}
        given |= {key: value for key, value in joint.items() if key in given}
        ends = {"lower": joint["lower"], "upper": joint["upper"], "closed": joint["lower"], "open": joint["upper"]}
        terms.append({"name": name, "type": joint["kind"], "label": "part", **given, **ends})
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "mobility.urdf").write_text(f'<robot name="{asset_id}">{links}{text}</robot>', encoding="utf-8")
    overlay = {"asset_id": asset_id, "contact_friction": 0.6, "support": {"kind": support}, "joints": terms,
               "links": [{"mass_kg": 10.0}, {"mass_kg": MASS}]}  # fmt: skip
    (folder / "overlay.json").write_text(json.dumps(overlay), encoding="utf-8")
    return folder


BASE = body("base", 10.0, "0 0 0", 1.0, box("0.4 0.4 0.1", "0 0 0.5"))
BALL = body("bob", MASS, f"0 0 -{ARM}", BALL_INERTIA)
ARM_OUT = body("lid", MASS, f"{ARM} 0 0", BALL_INERTIA)


def track(item: Any, joint: str, seconds: float) -> np.ndarray:
    """(n + 1,) positions, the first before any step."""
    values = [item.positions()[joint]]
    for _ in range(round(seconds / STEP)):
        item.step()
        values.append(item.positions()[joint])
    return np.array(values)


@every_engine
def test_a_pendulum_has_its_period_and_starts_where_the_overlay_says(engine: str, tmp_path: Path) -> None:
    folder = written(tmp_path, BASE + BALL, {"j": {"child": "bob", "initial_position": 0.1}})
    q = track(load(folder, engine), "j", 5.0)
    assert q[0] == pytest.approx(0.1, abs=1e-6)
    falls = np.flatnonzero((q[:-1] > 0.0) & (q[1:] <= 0.0))
    moments = falls + q[falls] / (q[falls] - q[falls + 1])
    period = 2.0 * math.pi * math.sqrt(MOMENT / (MASS * G * ARM)) * (1.0 + 0.1**2 / 16.0)
    assert np.diff(moments).mean() * STEP == pytest.approx(period, rel=0.01)


@every_engine
def test_a_transmission_in_the_file_changes_nothing(engine: str, tmp_path: Path) -> None:
    """SAPIEN's URDF loader dies on one, Drake makes a motor of it."""
    folder = written(tmp_path / "one", BASE + BALL, {"j": {"child": "bob", "initial_position": 0.1}})
    plain = track(load(folder, engine), "j", 0.5)
    old = '<transmission type="pr2_mechanism_model/SimpleTransmission" name="t"><actuator name="m"/><joint name="j"/>'
    drive = f"{old}<mechanicalReduction>1</mechanicalReduction></transmission></robot>"
    urdf = folder / "mobility.urdf"
    urdf.write_text(urdf.read_text(encoding="utf-8").replace("</robot>", drive), encoding="utf-8")
    assert track(load(folder, engine), "j", 0.5) == pytest.approx(plain, abs=1e-9)


@every_engine
def test_a_push_moves_part_and_armature_by_what_friction_leaves(engine: str, tmp_path: Path) -> None:
    """The inertia that counts is that of all that turns, not the free object's, which the overlay states."""
    friction, armature, effort, seconds = 0.5, 0.002, 0.8, 0.2
    joint = {"child": "bob", "axis": "0 0 1", "friction": friction, "armature": armature, "effective_inertia": 1e-5}
    arm = body("bob", MASS, f"{ARM} 0 0", BALL_INERTIA)
    item = load(written(tmp_path, BASE + arm, {"j": joint}), engine)
    for push, wanted in ((0.95 * friction, 0.0), (effort, (effort - friction) / (MOMENT + armature) * seconds)):
        item.reset()
        item.apply_effort({"j": push})
        track(item, "j", seconds)
        assert item.velocities()["j"] == pytest.approx(wanted, rel=0.03, abs=1e-3), push


@every_engine
def test_a_fixed_door_that_reaches_the_floor_does_not_scrape(engine: str, tmp_path: Path) -> None:
    """Of 20 kg, its leaf as low as its frame; 0.1 N·m opens it."""
    post = body("base", 10.0, "0 0 1", 1.0, box("0.1 0.1 2", "0 0 1"))
    leaf = body("leaf", 20.0, "0.5 0 1", 0.5, box("0.8 0.04 2", "0.5 0 1"))
    item = load(written(tmp_path, post + leaf, {"j": {"child": "leaf", "axis": "0 0 1", "lower": 0.0}}), engine)
    item.apply_effort({"j": 0.1})
    moved = track(item, "j", 1.0)[-1]
    assert moved == pytest.approx(0.1 / (0.5 + 20.0 * 0.5**2) * 0.5, rel=0.05)


@every_engine
def test_damping_takes_the_swing_that_it_should(engine: str, tmp_path: Path) -> None:
    damping = 0.02
    folder = written(tmp_path, BASE + BALL, {"j": {"child": "bob", "initial_position": 0.1, "damping": damping}})
    q = track(load(folder, engine), "j", 3.0)
    tops = [i for i in range(1, len(q) - 1) if q[i - 1] < q[i] >= q[i + 1]]
    rate = -np.polyfit(np.array(tops) * STEP, np.log(q[tops]), 1)[0]
    assert rate == pytest.approx(damping / (2.0 * MOMENT), rel=0.05)


@every_engine
@pytest.mark.parametrize(("share", "holds"), [(1.3, True), (0.7, False)])
def test_friction_over_the_load_holds_a_lid_and_less_does_not(
    engine: str, share: float, holds: bool, tmp_path: Path
) -> None:
    load_nm = MASS * G * ARM
    said = {"child": "lid", "axis": "0 -1 0", "friction": share * load_nm, "initial_position": 0.0, "damping": 0.01}
    folder = written(tmp_path, BASE + ARM_OUT, {"j": said | {"holds": holds, "lower": -1.5, "upper": 1.5}})
    q = track(load(folder, engine), "j", 3.0)
    assert bool(np.abs(q).max() <= 0.01) is holds
    assert holds or q[-1] < -0.5, "it falls, past where its weight pulls less than the friction holds"


@every_engine
def test_a_spring_carries_its_part_where_force_and_weight_are_equal(engine: str, tmp_path: Path) -> None:
    stiffness, rest = 200.0, 0.05
    said = {"kind": "prismatic", "child": "lid", "axis": "0 0 1", "stiffness": stiffness, "damping": 4.0}
    folder = written(tmp_path, BASE + ARM_OUT, {"j": said | {"spring_reference": rest, "lower": -0.2, "upper": 0.2}})
    q = track(load(folder, engine), "j", 4.0)
    assert q[-1] == pytest.approx(rest - MASS * G / stiffness, abs=1e-3)


@every_engine
@pytest.mark.parametrize("off", [1.7, 4.0])
def test_a_hinges_spring_is_as_strong_far_from_its_rest(engine: str, off: float, tmp_path: Path) -> None:
    """PhysX's free drives pull by 2 k sin(e / 2) where k e is meant, and the shorter way round."""
    stiffness = 0.5
    said = {"child": "lid", "axis": "0 0 1", "stiffness": stiffness, "damping": 0.3, "lower": -5.0, "upper": 5.0}
    item = load(written(tmp_path, BASE + ARM_OUT, {"j": said}), engine)
    item.apply_effort({"j": stiffness * off})
    assert track(item, "j", 6.0)[-1] == pytest.approx(off, abs=0.01)


@every_engine
def test_a_rocker_snaps_a_dial_clicks_and_a_seal_lets_go(engine: str, tmp_path: Path) -> None:
    snap = {"kind": "bistable", "slope": 2.0, "none_at": 0.0, "least": -1.0, "most": 1.0}
    said = {
        "child": "lid", "axis": "0 0 1", "friction": 0.05, "damping": 0.05, "lower": -0.5, "upper": 0.5, "bias": snap,
    }  # fmt: skip
    item = load(written(tmp_path / "rocker", BASE + ARM_OUT, {"j": said | {"initial_position": 0.5}}), engine)
    for effort, end in ((-0.9, 0.5), (-1.2, -0.5), (0.0, -0.5)):
        item.apply_effort({"j": effort})
        assert track(item, "j", 1.0)[-1] == pytest.approx(end, abs=0.02), effort
    dial = {"kind": "detent", "slope": -16.0, "none_at": 0.1, "least": -1.0, "most": 1.0, "period": 0.25}
    turned = said | {"friction": 0.2, "initial_position": 0.1, "bias": dial}
    item = load(written(tmp_path / "dial", BASE + ARM_OUT, {"j": turned}), engine)
    for effort, end in ((0.85, 0.1), (-0.85, 0.1), (1.1, 0.5)):
        item.reset()
        item.apply_effort({"j": effort})
        assert track(item, "j", 1.0)[-1] == pytest.approx(end, abs=0.1), effort
    seal = {"kind": "seal", "slope": 100.0, "none_at": 0.02, "least": -1.5, "most": 0.0}
    said |= {"lower": 0.0, "upper": 2.0, "bias": seal}
    item = load(written(tmp_path / "fridge", BASE + ARM_OUT, {"j": said}), engine)
    for effort, opens in ((1.4, False), (1.7, True)):
        item.apply_effort({"j": effort})
        assert bool(track(item, "j", 1.0)[-1] > 0.1) is opens, effort


@every_engine
def test_a_light_key_returns_to_its_reference(engine: str, tmp_path: Path) -> None:
    """A key of 1 g under 0.5 N, as a keyboard's: its spring is 16 times what the time step bears without armature."""
    key = body("key", 0.001, "0 0 0", 1e-7)
    said = {"kind": "prismatic", "child": "key", "axis": "0 0 1", "stiffness": 100.0, "armature": 0.02, "damping": 1.0,
            "effective_inertia": 0.001, "initial_position": -0.003, "lower": -0.003, "upper": 0.001}  # fmt: skip
    q = track(load(written(tmp_path, BASE + key, {"j": said}), engine), "j", 2.0)
    assert q[0] == pytest.approx(-0.003, abs=1e-6)
    assert q[-1] == pytest.approx(-0.001 * G / 100.0, abs=1e-4)
    assert q.max() <= 0.0011 and q.min() >= -0.0031


def root_height(item: Any, engine: str) -> float:
    """Height of the root's origin (its centre of mass too), m, as the engine's own handles give it."""
    if engine == "pybullet":
        import pybullet

        return float(pybullet.getBasePositionAndOrientation(item.body, physicsClientId=item.client)[0][2])
    if engine == "mujoco":
        import mujoco

        mujoco.mj_kinematics(item.model, item.data)  # else of the state before the step
    read: dict[str, Callable[[], Any]] = {
        "mujoco": lambda: item.data.body("base").xpos[2],
        "sapien": lambda: item.articulation.root_pose.p[2],
        "drake": lambda: item.plant.EvalBodyPoseInWorld(
            item.plant.GetMyContextFromRoot(item.simulator.get_context()),
            item.plant.GetBodyByName("base", item.instance),
        ).translation()[2],
        "genesis": lambda: item.entity.get_link("base").get_pos().flatten()[2],
        "newton": lambda: item.states[0].body_q.numpy()[
            [n.endswith("base") for n in item.builder.body_label].index(True)
        ][2],
    }
    return float(read[engine]())


@every_engine
@pytest.mark.parametrize("support", ["fixed", "freestanding"])
def test_a_fixed_object_stays_where_it_is_put_and_a_free_one_falls(engine: str, support: str, tmp_path: Path) -> None:
    folder = written(tmp_path, BASE + BALL, {"j": {"child": "bob"}}, support)
    item = load(folder, engine, position=(0.3, -0.2, 1.0))
    before = root_height(item, engine)
    for _ in range(60):
        item.step()
    fallen, falls = before - root_height(item, engine), G * STEP**2 * 60 * 61 / 2
    assert before == pytest.approx(1.0, abs=1e-6)
    assert fallen == pytest.approx(0.0 if support == "fixed" else falls, abs=1e-3)


@every_engine
def test_a_free_object_stands_on_its_lowest_point(engine: str, tmp_path: Path) -> None:
    solid = body("base", 10.0, "0 0 0", 0.1, box("0.4 0.4 0.3"))
    folder = written(tmp_path, solid + BALL, {"j": {"child": "bob", "initial_position": 0.0}}, "freestanding")
    item = load(folder, engine)
    for _ in range(240):
        item.step()
    assert root_height(item, engine) == pytest.approx(0.15, abs=2e-3)
    assert item.link_poses()["base"][2, 3] == pytest.approx(root_height(item, engine), abs=1e-4)
    if engine == "newton":
        with pytest.raises(LoadError, match="not read from Newton"):
            item.contacts()
    else:
        borne = sum(contact.force_n for contact in item.contacts() if contact.link == "base")
        assert borne == pytest.approx((10.0 + MASS) * G, rel=0.02)
    assert load(folder, engine, fixed=True).about.height_m == pytest.approx(0.15)


@every_engine
@pytest.mark.parametrize("support", ["freestanding", "fixed"])
def test_an_object_without_joints_is_loaded_and_lies_on_the_floor_or_is_held(
    tmp_path: Path, engine: str, support: str
) -> None:
    item = load(written(tmp_path, body("base", 10.0, "0 0 0", 1.0, box("0.4 0.4 0.1")), {}, support), engine)
    for _ in range(240):
        item.step()
    assert not item.joint_names and item.positions() == {}
    height = 0.05 + (0.01 if support == "fixed" else 0.0)
    assert item.link_poses()["base"][2, 3] == pytest.approx(height, abs=1e-3)


def test_the_pull_of_what_is_round_about_its_axis_is_on_its_rim(tmp_path: Path) -> None:
    wheel = body("wheel", MASS, "0 0 0", 0.01, '<collision><origin rpy="1.5707963 0 0"/><geometry>'
                 '<cylinder radius="0.3" length="0.1"/></geometry></collision>')  # fmt: skip
    knob = body("knob", MASS, "0 0 0", 0.01, '<visual name="knob-1"><geometry><box size="0.2 0.1 0.2"/></geometry>'
                "</visual>" + box("0.2 0.1 0.2"))  # fmt: skip
    about = describe(written(tmp_path, BASE + wheel + knob, {"roll": {"child": "wheel"}, "turn": {"child": "knob"}}))
    for joint, reach in zip(about.joints, (0.3, 0.1 * math.sqrt(2.0)), strict=True):
        assert joint.pull is not None
        assert joint.pull[1] == pytest.approx(0.0), "midway along its axis"
        assert math.hypot(joint.pull[0], joint.pull[2]) == pytest.approx(reach, rel=0.02)


def test_a_description_says_what_a_user_must_know(tmp_path: Path) -> None:
    handle = '<visual name="handle-3"><origin xyz="0.1 0 0"/><geometry><box size="0.02 0.02 0.02"/></geometry></visual>'
    drawer = body("drawer", MASS, "0 0 0", 0.01, box("0.4 0.2 0.1") + handle)
    lid = body("lid", MASS, "0.2 0 0", 0.01, box("0.4 0.2 0.02", "0.2 0 0"))
    folder = written(tmp_path, BASE + drawer + lid, {
        "slide": {"kind": "prismatic", "child": "drawer", "axis": "1 0 0", "lower": 0.0, "upper": 0.3, "holds": True},
        "hinge": {"child": "lid", "xyz": "0 0 0.6", "lower": -0.0, "upper": 1.0, "initial_position": 0.5},
    })  # fmt: skip
    about = describe(folder)
    slide, hinge = about.joints
    others = replace(hinge, gravity_load=-0.2), replace(hinge, stiffness=1.0)
    for other, does in zip((hinge, *others), ("moves freely", "gravity moves it", "springs back"), strict=True):
        assert f"revolute, 0 to 1 rad, starts at 0.5, {does}, pull lid" in str(other)
    assert (about.support, about.mass_kg, slide.unit, hinge.unit) == ("fixed", 10.5, "m", "rad")
    assert (slide.lower, slide.upper, slide.holds, hinge.initial_position) == (0.0, 0.3, True, 0.5)
    assert slide.pull == pytest.approx((0.1, 0.0, 0.0)) and hinge.pull == pytest.approx((0.4, 0.0, 0.0))
    assert about.height_m == pytest.approx(0.05), "the drawer's lower side is below its frame"
    assert "slide (part): prismatic, 0 to 0.3 m, starts at 0, holds, pull drawer at (0.100, 0.000, 0.000) m" in str(
        about
    )


def test_what_cannot_be_loaded_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(LoadError, match=r"lacks mobility\.urdf and overlay\.json; name the folder of a refined object"):
        load(tmp_path)
    folder = written(tmp_path / "one", BASE + BALL, {"j": {"child": "bob"}})
    with pytest.raises(LoadError, match="no engine 'unity'; choose one of pybullet, mujoco"):
        load(folder, "unity")
    import sys

    for missing, package in (("pydrake", "drake"), ("genesis", "genesis-world"), ("newton", r"newton\[sim\]")):
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, missing, None)
            patch.delitem(sys.modules, "pydrake.all", raising=False)
            with pytest.raises(ImportError, match=f"pip install '{package}'"):
                load(folder, {"pydrake": "drake"}.get(missing, missing))
    mesh = '<collision><geometry><mesh filename="hull.stl"/></geometry></collision>'
    for name, said in (
        ("hull.obj", "is not there"),
        ("hull.stl", "is no OBJ; refine the object with --collision repair"),
    ):
        other = written(
            tmp_path / name,
            BASE + body("bob", MASS, "0 0 0", 0.1, mesh.replace("hull.stl", name)),
            {"j": {"child": "bob"}},
        )
        (other / "hull.stl").write_bytes(b"solid")
        with pytest.raises(LoadError, match=said):
            describe(other)
    (folder / "overlay.json").write_text("{")
    with pytest.raises(LoadError, match=r"overlay\.json is damaged .*; refine the object again"):
        load(folder)


@every_engine
def test_what_is_given_is_checked_and_reset_undoes_it(engine: str, tmp_path: Path) -> None:
    said = {"child": "bob", "initial_position": 0.1, "effective_inertia": MOMENT}
    folder = written(tmp_path / "one", BASE + BALL, {"j": said})
    for options, wrong in (
        ({"timestep_s": -0.01}, "timestep_s: -0.01 is no time step"),
        ({"timestep_s": math.nan}, "timestep_s: nan is not a finite number"),
        ({"position": (0.0,)}, "position: .* is not 2 or 3 finite"),
        ({"position": "here"}, "position: here is not 2 or 3 finite"),
        ({"state": "ajar"}, 'no state "ajar"; choose "closed", "open", "random", or'),
        ({"state": "random", "seed": -1}, "seed: -1 is no whole number from 0 on"),
        ({"state": {"j": 5}}, "5 for joint 'j' is no share"),
        ({"timestep_s": 0}, "timestep_s: 0 is no time step"),
        ({"yaw": None}, "yaw: None is not a finite number"),
        ({"name": 5}, "name: 5 is no name"),
        ({"fixed": "no"}, "fixed: 'no' is not True, False or None"),
        ({"into": "my world"}, "into: 'my world' is not .*, which {engine} takes"),
    ):
        with pytest.raises(LoadError, match=wrong.replace("{engine}", engine)):
            load(folder, engine, **options)
    item = load(folder, f" {engine.capitalize()}", state={"j": 0.25})
    assert item.joint_names == ("j",) and item.positions()["j"] == pytest.approx(-1.5)
    setters: list[Any] = [item.set_positions, item.apply_effort, item.set_targets, item.reset]
    for setter in setters:
        for given, wrong in (
            ([0.1, 0.2], "2 numbers for 1 joints: j"),
            ({"k": 0.1}, "no joint 'k'; choose of j"),
            ({3: 0.1}, "no joint '3'; choose of j"),
            *(
                ({"j": odd}, "joint 'j': .* is not a finite number")
                for odd in (math.nan, -math.inf, "up", None, [0, 1], 1j)
            ),
            (math.nan, "joint 'j': nan is not a finite number"),
            (object(), "joint 'j': .* is not a finite number"),
        ):
            with pytest.raises(LoadError, match=f"{'state' if setter == item.reset else setter.__name__}.*{wrong}"):
                setter(given)
    with pytest.raises(LoadError, match="9 is beyond joint 'j', -3 to 3 rad"):
        item.set_positions(9.0)
    assert item.positions()["j"] == pytest.approx(-1.5), "what is refused changes nothing"
    item.set_positions([0.0])
    item.apply_effort({"j": 0.5})
    for _ in range(10):
        item.step()
    assert item.velocities()["j"] == pytest.approx(0.5 / MOMENT * 10 * STEP, rel=0.05)
    item.reset("closed")
    assert [item.positions()["j"], item.velocities()["j"]] == pytest.approx([-3.0, 0.0], abs=1e-5)
    item.reset("random", seed=7)
    assert item.positions() == pytest.approx(describe(folder).positions_at("random", 7), abs=1e-5)
    item.reset()
    item.set_targets({"j": 0.5})
    for _ in range(240):
        item.step()
    assert item.positions()["j"] == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("wrong", [3, None, ["mujoco"], "", "unreal"])
def test_what_is_no_engine_or_folder_is_refused_with_the_choices(wrong: Any, tmp_path: Path) -> None:
    folder = written(tmp_path, BASE + BALL, {"j": {"child": "bob"}})
    with pytest.raises(LoadError, match=r"no engine '.*'; choose one of pybullet, mujoco, sapien"):
        load(folder, wrong)
    with pytest.raises(LoadError, match="name the folder of a refined object"):
        load(wrong)


@every_engine
def test_an_object_that_failed_warns_with_its_reason(engine: str, tmp_path: Path) -> None:
    folder = written(tmp_path / "thing", BASE + BALL, {"j": {"child": "bob"}})
    assert describe(folder).verdict == "unknown"
    entry = {"path": "thing", "status": "failed", "failure_mode": "drift", "reason": "it drifts 3 cm"}
    (tmp_path / "index.json").write_text(json.dumps({"assets": [entry]}), encoding="utf-8")
    assert describe(folder).verdict == "drift"
    with pytest.warns(UserWarning, match="thing failed its checks: drift: it drifts 3 cm"):
        load(folder, engine)
    with pytest.raises(LoadError, match="it drifts 3 cm"):
        load(folder, engine, strict=True)


def test_the_same_object_twice_in_one_model(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    folder, world = written(tmp_path, BASE + BALL, {"j": {"child": "bob", "initial_position": 0.1}}), mujoco.MjSpec()
    items = [load(folder, "mujoco", into=world), load(folder, "mujoco", into=world, name="mine")]
    items.append(load(folder, "mujoco", into=world))
    assert [item.name for item in items] == ["thing", "mine", "thing_2"]
    with pytest.raises(LoadError, match="another object is named 'mine'"):
        load(folder, "mujoco", into=world, name="mine")
    with pytest.raises(LoadError, match=r"call finish\(model, data\)"):
        items[0].positions()
    model = world.compile()
    data = mujoco.MjData(model)
    for item in items:
        item.finish(model, data)
    items[1].set_positions({"j": 0.7})
    assert [item.positions()["j"] for item in items] == pytest.approx([0.1, 0.7, 0.1])


def test_a_root_called_world_is_where_it_was_put(tmp_path: Path) -> None:
    """MuJoCo takes a link of that name for its own world, where it cannot be placed, nor found by an object's name."""
    mujoco, spec = pytest.importorskip("mujoco"), pytest.importorskip("mujoco").MjSpec()
    held = '<link name="world"/><joint name="held" type="fixed"><parent link="world"/><child link="base"/></joint>'
    folder = written(tmp_path, held + BASE + BALL, {"j": {"child": "bob"}})
    item = load(folder, "mujoco", into=spec, position=(0.5, 0.0), fixed=False)
    model = spec.compile()
    item.finish(model, mujoco.MjData(model))
    before = item.link_poses()
    assert before["world"][:2, 3] == pytest.approx([0.5, 0.0]) and before["world"] == pytest.approx(before["base"])
    for _ in range(100):
        mujoco.mj_step(model, item.data)
    assert item.link_poses()["base"][2, 3] < before["base"][2, 3] - 0.01, "it falls"
    item.place()
    assert item.link_poses()["base"] == pytest.approx(before["base"])


@pytest.mark.parametrize("engine", [param for param in ENGINES if param.values[0] not in ("genesis", "newton")])
def test_two_objects_stand_in_a_world_of_the_users(engine: str, tmp_path: Path) -> None:
    """Beside each other, each in its state, in a world whose gravity and time step stay what they were."""
    solid = body("base", 10.0, "0 0 0", 0.1, box("0.2 0.2 0.2"))
    joint = {"child": "lid", "axis": "0 -1 0", "friction": 2.0 * MASS * G * ARM, "initial_position": 0.4, "holds": True}
    folders = [written(tmp_path / name, solid + ARM_OUT, {"j": joint}, "fixed", name) for name in ("first", "second")]
    world = WORLDS[engine]()
    first, second = (
        load(folder, engine, into=world, position=(x, 0.0)) for folder, x in zip(folders, (0.0, 1.0), strict=True)
    )
    assert load(folders[0], engine, into=world, position=(0.0, 5.0)).name == "first_2"
    with pytest.raises(LoadError, match="another object is named 'second'"):
        load(folders[0], engine, into=world, name="second")
    assert getattr(first, "model", None) is None, "before the user compiled it"
    for place, position in AFTER[engine](world, first, second):
        assert position == pytest.approx(0.4, abs=0.01)
        assert place[2] == pytest.approx(0.11, abs=1e-6), "what is fixed clears the floor by 1 cm"
    assert [round(float(place[0]), 6) for place, _ in AFTER[engine](world, first, second)] == [0.0, 1.0]


def pybullet_world() -> Any:
    import pybullet

    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0.0, 0.0, -3.7, physicsClientId=client)
    return client


def after_pybullet(world: Any, *items: Any) -> list[Any]:
    import pybullet

    for _ in range(120):
        pybullet.stepSimulation(physicsClientId=world)
    assert {item.client for item in items} == {world}
    at = [pybullet.getBasePositionAndOrientation(item.body, physicsClientId=world)[0] for item in items]
    return [(place, item.positions()["j"]) for place, item in zip(at, items, strict=True)]


def mujoco_world() -> Any:
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.timestep = 0.002
    return spec


def after_mujoco(world: Any, *items: Any) -> list[Any]:
    import mujoco

    model = world.compile()
    data = mujoco.MjData(model)
    assert model.opt.timestep == 0.002
    for item in items:
        item.finish(model, data)
    mujoco.mj_step(model, data, nstep=250)
    assert [item.data is data for item in items] == [True, True]
    names = ["first/", "second/"]
    return [(data.body(name + "base").xpos, item.positions()["j"]) for name, item in zip(names, items, strict=True)]


def sapien_world() -> Any:
    import sapien

    scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    scene.set_timestep(0.01)
    return scene


def after_sapien(world: Any, *items: Any) -> list[Any]:
    for _ in range(50):
        world.step()
    assert world.get_timestep() == pytest.approx(0.01)
    return [(item.articulation.root_pose.p, item.positions()["j"]) for item in items]


def drake_world() -> Any:
    import pydrake.all as drake

    builder = drake.DiagramBuilder()
    plant, _ = drake.AddMultibodyPlantSceneGraph(builder, time_step=0.002)
    plant.set_discrete_contact_approximation(drake.DiscreteContactApproximation.kSap)
    return builder, plant


def after_drake(world: Any, *items: Any) -> list[Any]:
    import pydrake.all as drake

    builder, plant = world
    if not plant.is_finalized():
        plant.Finalize()
        for item in items:
            item.finish()
        AFTER["simulator"] = drake.Simulator(builder.Build())
    simulator: Any = AFTER["simulator"]
    simulator.AdvanceTo(simulator.get_context().get_time() + 0.5)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    found = []
    for item in items:
        pose = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("base", item.instance))
        found.append((pose.translation(), plant.GetJointByName("j", item.instance).GetOnePosition(context)))
    return found


WORLDS = {"pybullet": pybullet_world, "mujoco": mujoco_world, "sapien": sapien_world, "drake": drake_world}
AFTER: dict[str, Any] = {
    "pybullet": after_pybullet,
    "mujoco": after_mujoco,
    "sapien": after_sapien,
    "drake": after_drake,
}


@pytest.mark.parametrize("engine", [param for param in ENGINES if param.values[0] in ("pybullet", "mujoco", "sapien")])
def test_parts_that_fixed_joints_hold_pass_each_other(engine: str, tmp_path: Path) -> None:
    """Two walls of a tray that slides, 5 cm deep in each other: nothing pushes."""
    walls = body("tray", 1.0, "0 0 0", 0.1)
    for name, x in (("left", -0.02), ("right", 0.03)):
        walls += body(name, 1.0, "0 0 0", 0.1, box("0.1 0.1 0.1"))
        walls += f'<joint name="{name}_held" type="fixed"><origin xyz="{x} 0 0"/><parent link="tray"/>' \
                 f'<child link="{name}"/></joint>'  # fmt: skip
    slide = {"kind": "prismatic", "axis": "1 0 0", "xyz": "0 0 0.9", "child": "tray", "friction": 50.0}
    item = load(written(tmp_path, BASE + walls, {"slide": slide}), engine)
    for _ in range(10):
        item.step()
        assert not item.contacts()
    assert item.positions()["slide"] == pytest.approx(0.0, abs=1e-6)


@every_engine
@pytest.mark.parametrize("passes", [True, False])
def test_parts_that_the_file_lets_pass_each_other_do(engine: str, passes: bool, tmp_path: Path) -> None:
    """A pendulum with a block and a bar across its way, on a hinge of its own that friction holds."""
    block = body("bob", MASS, f"0 0 -{ARM}", BALL_INERTIA, box("0.06 0.06 0.06", f"0 0 -{ARM}"))
    bar = body("bar", 5.0, "0 0 0", 0.1, box("0.02 0.2 0.02"))
    foot = body("base", 10.0, "0 0 0", 1.0, box("0.1 0.1 0.1", "1 0 0"))
    text = foot + block + bar + ('<disable_collisions link1="bob" link2="bar" reason="Default"/>' if passes else "")
    hangs = {"child": "bob", "xyz": "0 0 0.4", "initial_position": 0.6}
    joints = {"j": hangs, "k": {"child": "bar", "xyz": f"0 0 {0.4 - ARM}", "axis": "1 0 0", "friction": 50.0}}
    q = track(load(written(tmp_path, text, joints), engine), "j", 1.0)
    assert (q.min() < -0.4) == passes
