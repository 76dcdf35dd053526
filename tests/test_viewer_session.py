"""The viewer's simulation, without a page: hands, efforts, gravity and numbers, each beside its figure by hand."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import link_to_root
from asset2sim.viewer.live_object import HAND_MOST_N, LiveObject, open_live_object
from asset2sim.viewer.serve import open_viewer
from asset2sim.viewer.session import RAW, REFINED, ViewerSession, why_not
from asset2sim.viewer.viewed_object import ViewedObject, raw_subject, refined_subject
from schemas.errors import UsageError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine
from tests.assets import RAW as DATA
from tests.builders import UrdfJoint, UrdfLink, ball_inertia, box, write_urdf
from tests.exported import refined

pytestmark = pytest.mark.system
SETTINGS = EngineSettings()
STEP = SETTINGS.timestep_s
G = 9.81
MASS, FRICTION, DAMPING = 2.0, 3.0, 4.0
"""Of the drawer, kg, N and N·s/m."""
CASE_BOX, DRAWER_BOX = (box(0.4, 0.4, 0.1), (0.0, 0.0, 0.0)), (box(0.1, 0.1, 0.05), (0.1, 0.0, 0.0))
CASE = UrdfLink("case", mass=20.0, com=(0.05, 0.02, 0.1), inertia=ball_inertia(1.0), shapes=(CASE_BOX,))
DRAWER = UrdfLink("drawer", mass=MASS, com=(0.1, 0.0, 0.0), inertia=ball_inertia(0.02), shapes=(DRAWER_BOX,))
SLIDE = UrdfJoint("slide", "prismatic", "case", "drawer", (1.0, 0.0, 0.0), (0.0, 0.0, 0.3), 0.0, 0.6, DAMPING, FRICTION)
BOTH = pytest.mark.parametrize("engine", [Engine.PYBULLET, Engine.MUJOCO])


def chest(folder: Path, *, held: bool = True, **joint: object) -> ViewedObject:
    folder.mkdir(exist_ok=True)
    refined(folder, [CASE, DRAWER], [replace(SLIDE, **joint)])  # type: ignore[arg-type]
    return replace(refined_subject(folder), held=held)


@contextmanager
def opened(engine: Engine, folder: Path, *, held: bool = True, **joint: object) -> Iterator[LiveObject]:
    with open_live_object(chest(folder, held=held, **joint), engine, SETTINGS) as side:
        yield side


def middle(side: LiveObject) -> Array:
    """The drawer's centre of mass."""
    pose = side.poses()["drawer"]
    place: Array = pose[:3, :3] @ np.array(DRAWER.com) + pose[:3, 3]
    return place


def drawn(seconds: float, stiffness: float, reach: float) -> float:
    """Where the drawer is then, by hand: m x'' = k (reach − x) − c x' − f, from rest at zero, until it first stops."""
    rate, loss = math.sqrt(stiffness / MASS), DAMPING / (2.0 * MASS)
    end, turn = reach - FRICTION / stiffness, math.sqrt(rate**2 - loss**2)
    swing = math.cos(turn * seconds) + loss / turn * math.sin(turn * seconds)
    return end * (1.0 - math.exp(-loss * seconds) * swing)


@BOTH
def test_a_drawer_follows_the_hand_s_spring_over_its_friction_and_mass(engine: Engine, tmp_path: Path) -> None:
    stiffness, reach = 100.0, 0.3
    with opened(engine, tmp_path) as side:
        place = middle(side)
        side.grab("drawer", place, stiffness_n_m=stiffness, damping=0.0)
        side.drag(place + np.array([reach, 0.0, 0.0]))
        for count in (12, 36, 72, 96):
            while side.seconds < (count - 0.5) * STEP:
                side.step()
            now = side.positions()["slide"]
            # Both engines step the velocity first, and so are half a step ahead.
            assert now == pytest.approx(drawn((count + 0.5) * STEP, stiffness, reach), rel=0.01), count
            # What was applied in the last step is of where the drawer was before it.
            assert float(np.linalg.norm(side.force)) == pytest.approx(abs(stiffness * (reach - now)), abs=1.0)
        assert side.readings().hand_n > 1.0
        side.release()
        side.step(480)
        assert side.readings().hand_n == 0.0 and abs(side.readings().speeds["slide"]) < 1e-3


@BOTH
def test_a_hand_that_pulls_less_than_friction_moves_nothing(engine: Engine, tmp_path: Path) -> None:
    with opened(engine, tmp_path) as side:
        place = middle(side)
        side.grab("drawer", place, stiffness_n_m=100.0, damping=0.0)
        side.drag(place + np.array([0.9 * FRICTION / 100.0, 0.0, 0.0]))
        side.step(240)
        assert abs(side.positions()["slide"]) < 2e-4
        side.drag(place + np.array([1.5 * FRICTION / 100.0, 0.0, 0.0]))
        side.step(240)
        assert side.positions()["slide"] > 4e-3


@BOTH
def test_a_hand_of_its_own_strength_opens_the_drawer_and_never_pulls_more_than_a_person(
    engine: Engine, tmp_path: Path
) -> None:
    with opened(engine, tmp_path) as side:
        place = middle(side)
        side.grab("drawer", place)
        side.drag(place + np.array([0.3, 0.0, 0.0]))
        side.step(480)
        assert side.positions()["slide"] == pytest.approx(0.3, abs=0.05)
        side.drag(place + np.array([50.0, 0.0, 0.0]))
        side.step()
        assert float(np.linalg.norm(side.force)) <= HAND_MOST_N * (1.0 + 1e-9)


@BOTH
def test_a_hand_at_a_lever_turns_a_door(engine: Engine, tmp_path: Path) -> None:
    """Angular acceleration at first: force · lever / inertia about the axis."""
    inertia, lever, force = 0.05, 0.4, 2.0
    door = UrdfLink("door", mass=1.0, com=(0.2, 0.0, 0.0), inertia=ball_inertia(inertia - 0.2**2))
    hinge = UrdfJoint("hinge", "revolute", "case", "door", axis=(0.0, 0.0, 1.0), xyz=(0.0, 0.0, 0.3))
    refined(tmp_path, [CASE, door], [hinge])
    with open_live_object(replace(refined_subject(tmp_path), held=True), engine, SETTINGS) as side:
        edge = np.array([lever, 0.0, 0.3]) + side.poses()["case"][:3, 3]
        side.grab("door", edge, stiffness_n_m=force, damping=0.0)
        side.drag(edge + np.array([0.0, 1.0, 0.0]))
        side.step(10)
        assert side.readings().speeds["hinge"] == pytest.approx(force * lever / inertia * 10 * STEP, rel=0.02)


@BOTH
def test_poses_are_those_of_the_link_frames_wherever_their_centres_of_mass_are(engine: Engine, tmp_path: Path) -> None:
    with opened(engine, tmp_path, held=False) as side:
        side.set_position("slide", 0.25)
        found = side.poses()
        expected = link_to_root(side.subject.tree, "case", {"slide": 0.25})
        for link in ("case", "drawer"):
            assert np.linalg.inv(found["case"]) @ found[link] == pytest.approx(expected[link], abs=1e-6)
        # The case's box reaches 5 cm below its frame, and stands a fifth of a millimetre above the ground.
        assert found["case"][2, 3] == pytest.approx(0.05 + SETTINGS.drop_height_m, abs=2e-3)
        assert found["case"][:2, 3] == pytest.approx([0.0, 0.0], abs=1e-6)


@BOTH
def test_leaning_gravity_slides_a_drawer_without_friction(engine: Engine, tmp_path: Path) -> None:
    with opened(engine, tmp_path, friction=0.0, damping=0.0) as side:
        side.step(60)
        assert abs(side.positions()["slide"]) < 1e-6
        side.tilt(0.0, math.radians(-10.0))
        side.set_position("slide", 0.1)
        side.step(48)
        # As on a ground that was turned about y: +x has come down by as much as it now leans.
        seconds, pull = 48 * STEP, G * math.sin(math.radians(10.0))
        moved = side.positions()["slide"] - 0.1
        assert abs(moved) == pytest.approx(0.5 * pull * seconds**2, rel=0.05)


@BOTH
def test_kinetic_energy_effort_and_speed(engine: Engine, tmp_path: Path) -> None:
    with opened(engine, tmp_path, friction=0.0, damping=0.0) as side:
        side.set_effort("slide", 4.0)
        side.step(30)
        speed = 4.0 / MASS * 30 * STEP
        assert side.readings().speeds["slide"] == pytest.approx(speed, rel=0.01)
        assert side.readings().kinetic_j == pytest.approx(0.5 * MASS * speed**2, rel=0.02)
        side.reset()
        side.step(10)
        assert abs(side.readings().speeds["slide"]) < 1e-6


@BOTH
def test_overlap_and_contacts_are_read_where_they_are(engine: Engine, tmp_path: Path) -> None:
    # The lower drawer is 5 cm high, and the other one 4 cm above it.
    other = UrdfLink("other", mass=1.0, inertia=ball_inertia(0.01), shapes=(DRAWER_BOX,))
    above = replace(SLIDE, name="above", child="other", xyz=(0.0, 0.0, 0.34))
    refined(tmp_path, [CASE, DRAWER, other], [SLIDE, above])
    with open_live_object(refined_subject(tmp_path), engine, SETTINGS) as side:
        side.step(24)
        found = side.readings().phi_m
        depths = [
            -touch.separation_m for touch in side.touches() if {touch.link_a, touch.link_b} == {"drawer", "other"}
        ]
        assert found > 0.0 and max(depths) == pytest.approx(0.01, abs=3e-3)
        grounded = [touch for touch in side.touches() if touch.link_b == ""]
        assert grounded and all(abs(touch.place[2]) < 2e-3 for touch in grounded)


def test_a_hand_on_a_free_object_drags_all_of_it(tmp_path: Path) -> None:
    with opened(Engine.PYBULLET, tmp_path, held=False) as side:
        side.step(60)
        before = side.poses()["case"][0, 3]
        place = side.poses()["case"][:3, 3] + np.array([0.0, 0.0, 0.01])
        side.grab("case", place)
        side.drag(place + np.array([0.5, 0.0, 0.0]))
        side.step(480)
        assert side.poses()["case"][0, 3] - before > 0.1


@BOTH
def test_what_is_light_is_held_by_the_other_hand(engine: Engine, tmp_path: Path) -> None:
    """A blade that takes 3 N, in a knife of 0.25 kg which 1 N slides: without the other hand all of it follows."""
    handle, blade = replace(CASE, mass=0.2, inertia=ball_inertia(1e-3)), replace(DRAWER, mass=0.05)
    refined(tmp_path, [handle, blade], [SLIDE])
    knife = replace(refined_subject(tmp_path), held=False)
    assert knife.in_hand, "by its mass"
    for subject, opens in ((knife, True), (replace(knife, in_hand=False), False)):
        with open_live_object(subject, engine, SETTINGS) as side:
            side.step(60)
            before, place = side.poses()["case"][0, 3], middle(side)
            side.grab("drawer", place)
            for share in np.linspace(0.0, 1.0, 240):
                side.drag(place + np.array([0.3 * share, 0.0, 0.0]))
                side.step()
            moved = abs(side.poses()["case"][0, 3] - before)
            assert (bool(side.positions()["slide"] > 0.15), bool(moved < 0.02)) == (opens, opens), moved


def test_the_raw_object_goes_in_step_and_one_that_is_refused_costs_itself_alone(tmp_path: Path) -> None:
    raw_table = raw_subject(DATA / "Table/table_two_drawers", held=False)
    subjects: dict[str, ViewedObject | str] = {REFINED: chest(tmp_path / "r"), RAW: raw_table}
    with ViewerSession(subjects, Engine.PYBULLET, SETTINGS) as session:
        session.each(LiveObject.step, 24)
        assert not session.problems and all(side.seconds == pytest.approx(0.1) for side in session.sides.values())
        session.each(LiveObject.drop)
        raw = session.sides[RAW]
        height = raw.poses()[raw.subject.root][2, 3]
        session.each(LiveObject.step, 48)
        assert raw.poses()[raw.subject.root][2, 3] < height - 0.03
    with ViewerSession(subjects, Engine.MUJOCO, SETTINGS) as session:
        assert "MuJoCo refuses" in session.problems[RAW] and list(session.moving()) == [REFINED]
        session.each(LiveObject.nudge)
        session.each(LiveObject.step, 3)
        assert session.sides[REFINED].readings().speeds["slide"] > 0.05


def test_a_raw_object_that_crashes_the_engine_is_tried_elsewhere_and_costs_its_own_side(tmp_path: Path) -> None:
    raw = tmp_path / "raw"
    raw.mkdir()
    # A face of a corner that is none: PyBullet reads memory that is not its own.
    (raw / "part.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 400000000\nf 1 3 4\n")
    shape = '<geometry><mesh filename="part.obj"/></geometry>'
    (raw / "mobility.urdf").write_text(
        f'<robot name="a"><link name="base"><collision>{shape}</collision></link></robot>'
    )
    broken, whole = raw_subject(raw, held=False), raw_subject(DATA / "Table/table_two_drawers", held=False)
    said = why_not(broken, Engine.PYBULLET, SETTINGS)
    assert said is not None and "pybullet dies of it" in said and "SIGSEGV" in said
    assert why_not(whole, Engine.PYBULLET, SETTINGS) is None
    # What is refused without dying is said by the world itself.
    assert why_not(whole, Engine.MUJOCO, SETTINGS) is None
    subjects: dict[str, ViewedObject | str] = {REFINED: chest(tmp_path / "r"), RAW: broken}
    with ViewerSession(subjects, Engine.PYBULLET, SETTINGS, {RAW: said}) as session:
        session.each(LiveObject.step, 24)
        session.reset()
        session.each(LiveObject.step, 24)
        assert session.problems == {RAW: said} and session.sides[REFINED].seconds == pytest.approx(0.1)


def test_an_explosion_is_a_line_until_the_reset(tmp_path: Path) -> None:
    with ViewerSession({REFINED: chest(tmp_path, upper=1e9)}, Engine.MUJOCO, SETTINGS) as session:
        session.only(REFINED, LiveObject.set_effort, "slide", 1e9)
        session.each(LiveObject.step, 240)
        assert "exploded" in session.problems[REFINED] and not session.moving()
        session.each(LiveObject.step, 10)
        session.reset()
        session.each(LiveObject.step, 10)
        assert not session.problems and abs(session.sides[REFINED].positions()["slide"]) < 1e-3


def test_a_python_error_of_an_engine_is_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with ViewerSession({REFINED: chest(tmp_path)}, Engine.PYBULLET, SETTINGS) as session:
        monkeypatch.setattr(session.sides[REFINED].world, "step", lambda count=1: 1 / 0)
        session.each(LiveObject.step)
        assert session.problems[REFINED] == "ZeroDivisionError: division by zero"


def test_without_viser_a_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("asset2sim.viewer.serve.find_spec", lambda name: None)
    opening = open_viewer(tmp_path, None, engine=Engine.PYBULLET, host="127.0.0.1", port=8080, settings=SETTINGS)
    with pytest.raises(UsageError, match=r"needs viser, which is not installed; pip install .*\[view\]"), opening:
        pass


def test_a_position_is_a_share_of_each_object_s_own_range(tmp_path: Path) -> None:
    (tmp_path / "raw").mkdir()
    longer = replace(SLIDE, upper=1.2)
    write_urdf(tmp_path / "raw", [CASE, DRAWER], [longer])
    subjects: dict[str, ViewedObject | str] = {
        REFINED: chest(tmp_path / "r"),
        RAW: raw_subject(tmp_path / "raw", held=True),
    }
    with ViewerSession(subjects, Engine.PYBULLET, SETTINGS) as session:
        session.each(LiveObject.set_share, "slide", 0.5)
        found = {name: side.positions()["slide"] for name, side in session.sides.items()}
        assert found == {REFINED: pytest.approx(0.3), RAW: pytest.approx(0.6)}
        session.each(LiveObject.drop)
        assert session.sides[REFINED].positions()["slide"] == pytest.approx(0.3), "it falls as it was placed"
