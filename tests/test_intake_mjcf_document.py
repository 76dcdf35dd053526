"""MJCF files as people have them, which MuJoCo alone refuses: read, and what was left out is said."""

from pathlib import Path

import pytest

from asset2sim.intake.formats.mjcf import urdf_of_mjcf
from asset2sim.intake.formats.mjcf_document import schema
from schemas.errors import AssetError

pytestmark = pytest.mark.system
"""Reading MJCF loads MuJoCo, which starts a program."""

BODY = '<body name="base"><geom type="box" size="0.1 0.1 0.1"/>{more}</body>'
LID = '<body name="lid" pos="0 0 0.1"><joint name="hinge" axis="1 0 0" range="0 90"/>{more}</body>'
SOLID = '<geom type="box" size="0.1 0.1 0.01"/>'


def written(folder: Path, world: str, rest: str = "") -> Path:
    file = folder / "model.xml"
    file.write_text(f'<mujoco model="m">{rest}<worldbody>{world}</worldbody></mujoco>', encoding="utf-8")
    return file


def links_and_notes(file: Path, work: Path) -> tuple[list[str], str]:
    work.mkdir()
    made = urdf_of_mjcf(file, work)
    return [str(link.get("name")) for link in made.robot.findall("link")], "; ".join(made.notes)


@pytest.mark.parametrize(
    ("world", "rest", "said"),
    [
        (BODY.format(more=LID.format(more='<geom type="box" size="1 1 1" mass="0"/>')), "", ""),
        (BODY.format(more=LID.format(more="")), "", ""),
        (BODY.format(more=f'<region name="r"/>{LID.format(more=SOLID)}'), "", "<region>, which MuJoCo does not know"),
        (BODY.format(more=LID.format(more=SOLID.replace("/>", ' colour="red"/>'))), "", "'colour' of <geom>"),
        (
            BODY.format(
                more=LID.format(more=f"{SOLID.replace('<geom', '<geom name=x')}{SOLID}".replace("=x", '="x"') * 2)
            ),
            "",
            "a second geom 'x' has no name",
        ),
        (
            BODY.format(more=LID.format(more=SOLID.replace("/>", ' material="wood"/>'))),
            '<asset><texture name="t" type="2d" file="gone.png"/><material name="wood" texture="t"/></asset>',
            "texture 't' is left out: its file 'gone.png' is not there",
        ),
        (
            BODY.format(more=LID.format(more=f'{SOLID}<geom type="mesh" mesh="gone"/>')),
            '<asset><mesh file="gone.stl"/></asset>',
            "mesh 'gone' is left out: its file 'gone.stl' is not there",
        ),
    ],
    ids=["massless geom", "massless body", "element", "attribute", "name twice", "texture gone", "mesh gone"],
)
def test_what_mujoco_refuses_is_read_and_what_is_left_out_is_said(
    world: str, rest: str, said: str, tmp_path: Path
) -> None:
    links, notes = links_and_notes(written(tmp_path, world, rest), tmp_path / "work")
    assert links == ["base", "lid"] and said in notes and bool(said) == bool(notes)


def test_a_mended_file_keeps_its_includes_its_folders_and_the_masses_that_it_states(tmp_path: Path) -> None:
    stated = '<inertial pos="0 0 0" mass="0.7" diaginertia="0.01 0.01 0.01"/>'
    (tmp_path / "lid.xml").write_text(
        f"<mujoco>{LID.format(more=stated + SOLID + '<unknown/>')}</mujoco>", encoding="utf-8"
    )
    work = tmp_path / "work"
    work.mkdir()
    made = urdf_of_mjcf(written(tmp_path, BODY.format(more='<include file="lid.xml"/>')), work)
    base, lid = made.robot.findall("link")
    assert base.find("inertial") is None, "none is stated, and MuJoCo's own guess does not count"
    mass = lid.find("inertial/mass")
    assert mass is not None and float(str(mass.get("value"))) == 0.7


def test_what_cannot_be_mended_names_the_file_and_mujocos_reason(tmp_path: Path) -> None:
    for world, said in (
        (BODY.format(more=LID.format(more=SOLID.replace("0.1 0.1 0.01", "big"))), "model.xml: MuJoCo refuses it"),
        (BODY.format(more='<include file="gone.xml"/>'), r"its include 'gone.xml' is not there: restore the file"),
        (BODY.format(more='<include file="model.xml"/>'), "break the circle"),
    ):
        with pytest.raises(AssetError, match=said):
            urdf_of_mjcf(written(tmp_path, world), tmp_path)


def test_the_schema_has_what_objects_are_made_of() -> None:
    assert {"body", "worldbody", "geom", "joint", "inertial", "mesh", "texture", "equality"} <= set(schema())
    assert {"pos", "quat", "name"} <= schema()["body"] and {"range", "damping", "armature"} <= schema()["joint"]
