"""Datasets as users keep them: manifests with and without faults, bare folders, one asset."""

import errno
import inspect
import os
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from asset2sim.assets.companions import companions_of, read_category, read_semantics
from asset2sim.assets.urdf.references import ANYWHERE
from asset2sim.intake import dataset
from asset2sim.intake.dataset import check_asset_id, load_dataset
from asset2sim.intake.locate import find_source
from asset2sim.runs.plan.plan import asset_files_hashes
from asset2sim.runs.plan.state import open_state
from asset2sim.storage.tree import Tree, local_tree
from flows import command
from flows.refine_dataset import discover, refine_dataset
from schemas.errors import MISTAKE, MOST_MISTAKES, AssetError, UnknownChoiceError, UsageError
from schemas.location import Location
from schemas.vocabulary import UpAxis
from tests.marks import OBJECTS, needs_objects


def write_manifest(folder: Path, text: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "manifest.csv").write_text(text, encoding="utf-8")
    return folder


def write_urdf(folder: Path, name: str = "mobility.urdf") -> Path:
    folder.mkdir(parents=True)
    (folder / name).write_text("<robot name='x'><link name='base'/></robot>", encoding="utf-8")
    return folder


FULL = """asset_id,category,path,subset,prompt
b,Box,Box/b,one,"A box, slightly open."
a,Box,Box/a,two,
c,Lamp,Lamp/c,one,A lamp.
"""


def test_manifest_rows_keep_their_order_and_get_absolute_paths(tmp_path: Path) -> None:
    data = write_manifest(tmp_path, FULL)
    refs = load_dataset(data)
    assert [ref.asset_id for ref in refs] == ["b", "a", "c"]
    assert refs[0].path == str(tmp_path.resolve() / "Box" / "b")
    assert (refs[0].prompt, refs[1].prompt) == ("A box, slightly open.", None)


def test_only_asset_id_and_path_are_required(tmp_path: Path) -> None:
    data = write_manifest(tmp_path, "path,asset_id\nBox/a,a\n")
    (ref,) = load_dataset(data)
    assert (ref.asset_id, ref.category, ref.subset, ref.prompt) == ("a", None, None, None)


def test_a_row_may_state_the_axis_that_points_up(tmp_path: Path) -> None:
    refs = load_dataset(write_manifest(tmp_path, "asset_id,path,up\na,a,-y\nb,b,\n"))
    assert [ref.up for ref in refs] == [UpAxis.MINUS_Y, None]
    write_manifest(tmp_path, "asset_id,path,up\na,a,w\n")
    with pytest.raises(UsageError, match="line 2: up 'w' is no axis; choose from: x, y, z, -x, -y, -z"):
        load_dataset(tmp_path)


def test_a_row_may_name_a_file_beside_others_of_its_folder(tmp_path: Path) -> None:
    folder = write_urdf(tmp_path / "Side Table", "Side Table.urdf")
    (folder / "other.urdf").write_text("<robot name='other'><link name='base'/></robot>", encoding="utf-8")
    rows = "asset_id,path\ntable,Side Table/Side Table.urdf\nother,Side Table/other.urdf\n"
    found = [find_source(Path(ref.path)).name for ref in load_dataset(write_manifest(tmp_path, rows))]
    assert found == ["Side Table.urdf", "other.urdf"]


def test_a_manifest_is_read_as_other_systems_write_it(tmp_path: Path) -> None:
    """With a byte order mark, their line ends, blank lines, and blanks around names."""
    (tmp_path / "manifest.csv").write_bytes(b"\xef\xbb\xbfasset_id, path\r\n\r\na, Box/a\r\n\r\nc,d")
    assert [(ref.asset_id, Path(ref.path).name) for ref in load_dataset(tmp_path)] == [("a", "a"), ("c", "d")]


def test_a_row_without_its_folder_stays(tmp_path: Path) -> None:
    refs = load_dataset(write_manifest(tmp_path, FULL))
    assert len(refs) == 3
    assert not Path(refs[0].path).exists()


def test_subset_ids_and_limit_choose(tmp_path: Path) -> None:
    data = write_manifest(tmp_path, FULL)
    assert [ref.asset_id for ref in load_dataset(data, subset="one")] == ["b", "c"]
    assert [ref.asset_id for ref in load_dataset(data, asset_ids=["c", "a"])] == ["a", "c"]
    assert [ref.asset_id for ref in load_dataset(data, limit=2)] == ["b", "a"]
    assert [ref.asset_id for ref in load_dataset(data, limit=99)] == ["b", "a", "c"]


def test_unknown_choices_name_the_valid_ones(tmp_path: Path) -> None:
    data = write_manifest(tmp_path, FULL)
    with pytest.raises(UnknownChoiceError, match="subset 'three'; choose from: one, two"):
        load_dataset(data, subset="three")
    with pytest.raises(UnknownChoiceError, match="asset 'z'; choose from: a, b, c"):
        load_dataset(data, asset_ids=["a", "z"])
    with pytest.raises(UnknownChoiceError, match="asset 'a'; choose from: b, c"):
        load_dataset(data, subset="one", asset_ids=["a"])
    with pytest.raises(UsageError, match="from 1 to 3"):
        load_dataset(data, limit=0)


def test_asset_folders_one_level_down(tmp_path: Path) -> None:
    write_urdf(tmp_path / "shelf", "model.urdf")
    write_urdf(tmp_path / "fridge" / "urdf", "fridge.urdf")
    (tmp_path / "notes").mkdir()
    refs = load_dataset(tmp_path)
    assert [ref.asset_id for ref in refs] == ["fridge", "shelf"]
    assert refs[0].path == str(tmp_path.resolve() / "fridge")


def test_asset_folders_two_levels_down_have_their_parent_as_category(tmp_path: Path) -> None:
    write_urdf(tmp_path / "Box" / "100")
    told = write_urdf(tmp_path / "Box" / "101")
    (told / "meta.json").write_text('{"model_cat": "Chest"}', encoding="utf-8")
    refs = load_dataset(tmp_path)
    assert [(ref.asset_id, ref.category) for ref in refs] == [("100", "Box"), ("101", None)]


def test_one_asset_folder_is_a_dataset(tmp_path: Path) -> None:
    (ref,) = load_dataset(write_urdf(tmp_path / "100"))
    assert (ref.asset_id, ref.path) == ("100", str(tmp_path.resolve() / "100"))


MJCF = "<mujoco><worldbody><body name='b'><joint name='j'/><geom size='1'/></body></worldbody></mujoco>"
SDF = "<sdf version='1.6'><model name='m'><link name='l'/></model></sdf>"
URDF = "<robot name='x'><link name='base'/></robot>"
PIECE = "<mujocoinclude><body name='p'><joint name='k'/><geom size='1'/></body></mujocoinclude>"
AROUND = "<mujoco><include file='{}'/></mujoco>"


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({"a.xml": MJCF, "b.xml": MJCF, "README.md": "", "assets/x.xml": PIECE}, ["a", "b"]),
        ({f"{name}.sdf": SDF for name in "abcdef"}, [*"abcdef"]),
        ({"a.urdf": URDF, "a.xml": MJCF, "b.xml": MJCF}, ["a", "b"]),
        ({"urdf/left.urdf": URDF, "urdf/right.urdf": URDF, "urdf/left.urdf.xacro": "", "old/left.urdf": URDF,
          "package.xml": "<package/>"}, ["left", "right"]),
        ({"scene.xml": AROUND.format("a.xml"), "a.xml": MJCF, "b.xml": MJCF}, ["a", "b"]),
        ({"one/l.urdf": URDF, "one/r.urdf": URDF, "two/x.urdf": URDF}, ["one_l", "one_r", "two"]),
        ({"door/door.usda": "#usda 1.0", "door/physics.usda": "#usda 1.0"}, ["door"]),
        ({"door-1_3.sdf": SDF, "door-1_4.sdf": SDF, "lid.sdf": SDF}, ["door-1_4", "lid"]),
    ],
)  # fmt: skip
def test_several_descriptions_in_a_folder_are_assets_by_their_files(
    tmp_path: Path, files: dict[str, str], expected: list[str]
) -> None:
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    refs = load_dataset(tmp_path)
    assert [ref.asset_id for ref in refs] == expected
    for ref in refs:
        found = find_source(Path(ref.path))
        assert load_dataset(found)[0].asset_id == (ref.asset_id if expected[0] != "one_l" else found.stem)
        assert "old" not in found.parts and "1_3" not in found.name and found.name != "scene.xml"


def test_ids_of_files_that_differ_in_case_at_most_stay_apart(tmp_path: Path) -> None:
    for name in ("Lid.urdf", "lid.urdf", "box.urdf", "1/door/l.urdf", "1/door/r.urdf", "2/door/l.urdf",
                 "2/door/r.urdf"):  # fmt: skip
        place = tmp_path / ("deep" if "/" in name else "flat") / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(URDF)
    first = [ref.asset_id for ref in load_dataset(tmp_path / "flat")]
    assert "box" in first and len({name.casefold() for name in first}) == 3
    (tmp_path / "flat").rename(tmp_path / "moved")
    assert [ref.asset_id for ref in load_dataset(tmp_path / "moved")] == first, "wherever the dataset lies"
    assert len({ref.asset_id for ref in load_dataset(tmp_path / "deep")}) == 4


def test_a_scene_of_pieces_is_the_model(tmp_path: Path) -> None:
    pieces = "".join(f"<include file='{name}.xml'/>" for name in "ab")
    (tmp_path / "kitchen.xml").write_text(f"<mujoco><worldbody>{pieces}</worldbody></mujoco>")
    for name in "ab":
        (tmp_path / f"{name}.xml").write_text(PIECE)
    assert find_source(tmp_path).name == "kitchen.xml"
    for name in "ab":  # pieces that are models as well
        (tmp_path / f"{name}.xml").write_text(MJCF)
    assert find_source(tmp_path).name == "kitchen.xml"


def test_a_missing_folder_names_what_is_there(tmp_path: Path) -> None:
    (tmp_path / "partnet").mkdir()
    with pytest.raises(UsageError, match=r"no dataset at .*partnt: .* has the folders partnet"):
        load_dataset(tmp_path / "partnt")


def test_a_folder_without_assets_and_a_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"neither manifest\.csv"):
        load_dataset(tmp_path)
    file = tmp_path / "x.txt"
    file.write_text("", encoding="utf-8")
    with pytest.raises(UsageError, match="is a file"):
        load_dataset(file)


def test_real_names_are_safe_and_separators_are_not() -> None:
    assert check_asset_id("room73b2-toshiba clacio.v2_ü", "x") == "room73b2-toshiba clacio.v2_ü"
    for bad in ("a/b", "a\\b", "a\nb", ".hidden", " a", "x" * 300):
        with pytest.raises(UsageError):
            check_asset_id(bad, "x")


@needs_objects
def test_the_real_manifest_and_the_same_folders_without_it() -> None:
    refs = load_dataset(OBJECTS)
    assert len(refs) == 150
    assert len(load_dataset(OBJECTS, subset="paper9")) == 9
    assert all(Path(ref.path).is_dir() for ref in refs)
    boxes = load_dataset(OBJECTS / "Box")
    assert {ref.asset_id for ref in boxes} == {ref.asset_id for ref in refs if ref.category == "Box"}


def test_a_run_lists_its_dataset_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the command line to the plan; the flow's own steps before and after need a server."""
    listed: list[Path] = []

    def counted(root: Path) -> Tree:
        listed.append(root)
        return local_tree(root)

    def flow(*arguments: object, **options: object) -> None:
        asked = inspect.signature(refine_dataset.fn).bind(*arguments, **options)
        asked.apply_defaults()
        refs = discover.fn(*(asked.arguments[name] for name in inspect.signature(discover.fn).parameters))
        with open_state(tmp_path / "out") as state:
            assert len(asset_files_hashes(state, refs)) == 2
        raise UsageError("planned")

    data = write_urdf(tmp_path / "data" / "a").parent
    write_urdf(data / "b")
    monkeypatch.setattr(dataset, "local_tree", counted)
    monkeypatch.setattr("flows.refine_dataset.refine_dataset", flow)
    monkeypatch.setattr("flows.server.server.temporary_server", nullcontext)
    monkeypatch.setattr("asset2sim.experiments.isolation.children.warm_up", lambda pipeline: None)
    monkeypatch.setattr("asset2sim.models.gateway.environment.load_litellm", lambda: None)
    assert command.main(["refine", str(data), "--out", str(tmp_path / "out")]) == MISTAKE
    assert listed == [data.resolve()]


# Nothing vanishes: whatever there is, is an asset, with what is wrong with it


def listed(data: Path) -> dict[str, str]:
    """Asset id → its fault, or "" for one without."""
    return {ref.asset_id: ref.fault or "" for ref in load_dataset(data)}


def test_a_link_that_leads_nowhere_or_to_itself_is_an_asset_and_takes_no_other_along(tmp_path: Path) -> None:
    write_urdf(tmp_path / "Box" / "100")
    write_urdf(tmp_path / "good")
    (tmp_path / "self").symlink_to("self")
    (tmp_path / "gone").symlink_to(tmp_path / "nowhere")
    (tmp_path / "Box" / "101").symlink_to("101")
    (tmp_path / "long").symlink_to("x" * 300)
    found = listed(tmp_path)
    assert set(found) == {"100", "101", "good", "self", "gone", "long"}
    assert not found["good"] and not found["100"]
    assert "is a link that leads back to itself" in found["self"] and "leads back to itself" in found["101"]
    assert "is a link to" in found["gone"] and "which is not there" in found["gone"]
    assert "is a link to a name that is too long" in found["long"]


def test_a_folder_that_cannot_be_listed_is_an_asset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests may run as root, whom no permission keeps out."""
    for name in ("a", "b", "Box/1", "Box/2"):
        write_urdf(tmp_path / name)
    scandir = os.scandir
    shut = [str(tmp_path / "b"), str(tmp_path / "Box" / "2")]

    def refusing(path: Any) -> Any:
        if str(path) in shut:
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return scandir(path)

    monkeypatch.setattr(os, "scandir", refusing)
    found = listed(tmp_path)
    assert set(found) == {"a", "b", "1", "2"} and not found["a"] and not found["1"]
    assert (
        found["b"] == f"{tmp_path / 'b'}: it cannot be read (Permission denied); mend it, or take it out of the dataset"
    )
    assert "Permission denied" in found["2"]
    shut.append(str(tmp_path))
    with pytest.raises(UsageError, match="Permission denied"):
        load_dataset(tmp_path)


def test_what_is_named_as_a_description_and_is_no_file_is_an_asset_that_fails(tmp_path: Path) -> None:
    write_urdf(tmp_path / "good")
    for name in ("pipe", "folder", "link", "capitals"):
        (tmp_path / name).mkdir()
    os.mkfifo(tmp_path / "pipe" / "mobility.urdf")
    (tmp_path / "folder" / "mobility.urdf").mkdir()
    (tmp_path / "link" / "mobility.urdf").symlink_to("mobility.urdf")
    (tmp_path / "capitals" / "BOX.URDF").write_text("<robot/>")
    assert set(listed(tmp_path)) == {"good", "pipe", "folder", "link", "capitals"}
    said = {}
    for name in ("pipe", "folder", "link", "capitals"):
        with pytest.raises(AssetError) as caught:
            find_source(tmp_path / name)
        said[name] = str(caught.value)
    assert "mobility.urdf is a pipe, not a file" in said["pipe"]
    assert "mobility.urdf is a folder, not a file" in said["folder"]
    assert "mobility.urdf is a link that leads back to itself" in said["link"]
    assert "write the ending of BOX.URDF in small letters" in said["capitals"]


def test_a_folder_that_lost_its_urdf_is_an_asset_and_a_folder_of_notes_is_none(tmp_path: Path) -> None:
    write_urdf(tmp_path / "good")
    for name in ("lost", "Box/lost2"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "meta.json").write_text("{}")
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "todo.txt").write_text("")
    assert set(listed(tmp_path)) == {"good", "lost", "lost2"}


def test_pipes_are_not_waited_for(tmp_path: Path) -> None:
    write_urdf(tmp_path / "good")
    (tmp_path / "mjcf").mkdir()
    os.mkfifo(tmp_path / "mjcf" / "model.xml")
    os.mkfifo(tmp_path / "good" / "meta.json")
    assert set(listed(tmp_path)) == {"good", "mjcf"}
    os.mkfifo(tmp_path / "good" / "semantics.txt")
    assert (
        read_category(tmp_path / "good" / "meta.json") == "" and read_semantics(tmp_path / "good/semantics.txt") == {}
    )
    _, findings = companions_of(tmp_path / "good", ANYWHERE)
    assert "'semantics.txt' is a pipe, not a file; it is left out" in [finding.message for finding in findings]
    os.mkfifo(tmp_path / "manifest.csv")
    with pytest.raises(UsageError, match=r"manifest\.csv: it is a pipe, not a file"):
        load_dataset(tmp_path)


def test_a_folder_whose_name_cannot_be_an_id_is_an_asset_with_another(tmp_path: Path) -> None:
    write_urdf(tmp_path / "good")
    names = ["a,b", "two\nlines", os.fsdecode(b"latin\xe9"), "null", " blank", "x" * 240]
    for name in names:
        write_urdf(tmp_path / name)
    found = listed(tmp_path)
    ids = ["a%2Cb", "two%0Alines", "latin%E9", "%20null", "%20blank"]
    assert set(ids) < set(found) and len(found) == 7
    assert all("rename the folder" in fault for asset_id, fault in found.items() if asset_id != "good")
    assert all(check_asset_id(asset_id, "x") for asset_id in found)
    assert "\n" not in found["two%0Alines"]


def test_a_row_whose_path_is_a_circle_of_links_is_an_asset_with_a_fault(tmp_path: Path) -> None:
    (tmp_path / "self").symlink_to("self")
    write_manifest(tmp_path, "asset_id,path\na,good\nb,self\nc,self/deeper\n")
    found = listed(tmp_path)
    assert found["a"] == "" and "line 3: its path 'self' is a link that leads back to itself" in found["b"]
    assert "line 4" in found["c"]


def test_a_dataset_of_nothing_but_faults_is_the_users_mistake(tmp_path: Path) -> None:
    (tmp_path / "self").symlink_to("self")
    with pytest.raises(UsageError, match=r"neither manifest\.csv.*self: it is a link that leads back to itself"):
        load_dataset(tmp_path)


@pytest.mark.parametrize("name", ["x" * 300, os.fsdecode(b"\xff"), "self", "self/in"])
def test_paths_that_no_file_system_can_have_are_the_users_mistake(tmp_path: Path, name: str) -> None:
    (tmp_path / "self").symlink_to("self")
    for function in (load_dataset, Location.absolute):
        if not (function is load_dataset and "\udcff" in name):  # the command line refuses it before
            with pytest.raises(UsageError) as caught:
                function(Location(str(tmp_path / name)))
            assert "\n" not in str(caught.value)


# Manifests that are wrong say so


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("id,path\na,b\n", "column asset_id missing; it has id, path"),
        ("", "column asset_id, path missing"),
        ("asset_id,path\n", "no rows"),
        ("asset_id,path\na,x\na,y\n", "asset_id a more than once"),
        ("asset_id,path\nBox,x\nb,y\nbox,z\n", "csv, lines 2 and 4: asset_id Box and box name the same folder"),
        ("asset_id,path\n../a,x\n", "line 2: asset_id '../a' holds '/'"),
        ("asset_id,path\n..,x\n", "may not be empty or start with"),
        ("asset_id,path\n,x\n", "may not be empty"),
        ("asset_id,path\na,\n", "line 2: asset 'a' has no path"),
        ("asset_id,path\na,b,c\n", "more cells than columns"),
        ("asset_id,path,promt\na,a,x\n", "column 'promt' is unknown; is it 'prompt'?"),
        ("asset_id,path,Prompt\na,a,x\n", "column 'Prompt' is unknown; is it 'prompt'?"),
        ("asset_id,paths\na,a\n", "column 'paths' is unknown; is it 'path'?"),
        ("asset_id,path,prompt,prompt\na,a,x,y\n", "column prompt more than once"),
        ("asset_id;path\na;a\n", "separate cells by commas, not by semicolons"),
        ("asset_id\tpath\na\ta\n", "not by tabs"),
        (
            'asset_id,path,prompt\na,a,"x\nb,b,y\nc,c,z\n',
            "line 2: a quote opens here, and nothing closes it down to line 4",
        ),
        ('asset_id,path,prompt\na,a,"x\nb,b,"y"\n', "line 2: a quote ends in the middle of a cell down to line 3"),
        ('asset_id,path,prompt\na,a,"x\nb,b,"\nc,c,z\n', "line 2: its cell 'prompt' goes on over 1 more lines"),
        ('asset_id,path,prompt\na,"a\nb,b",x\n', "line 2: its cell 'path' goes on over 1 more lines"),
        (f"asset_id,path,prompt\na,a,x\nb,b,{'y' * 20_000}\n", "line 3: column 'prompt' has 20,000 characters"),
        (f"asset_id,path,prompt\nb,b,{'y' * 200_000}\n", "line 2: "),
        ('asset_id,path\n"a,b",x\n', "line 2: asset_id 'a,b' holds ',', which separates the ids of --assets"),
        ("asset_id,path\nnull,x\n", "means none in --assets"),
        ("asset_id,path\na\x07b,x\n", "holds '\\x07'"),
        ("asset_id,path\na\0b,x\n", "line 2: it holds a NUL byte"),
    ],
)
def test_a_wrong_manifest_names_line_and_remedy(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(UsageError) as caught:
        load_dataset(write_manifest(tmp_path, content))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("asset_id,path\na,é\n".encode("latin-1"), "line 2: byte 0xe9 is not UTF-8; save it as UTF-8"),
        ("asset_id,path\na,b\n".encode("utf-16"), "its text is in UTF-16"),
        ("asset_id,path\na,b\n".encode("utf-16-le"), "line 1: it holds a NUL byte"),
    ],
)
def test_another_encoding_is_named_with_its_line(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "manifest.csv").write_bytes(content)
    with pytest.raises(UsageError, match=message):
        load_dataset(tmp_path)


def test_all_mistakes_of_both_tables_are_said_at_once_with_their_lines(tmp_path: Path) -> None:
    data = write_manifest(
        tmp_path,
        "asset_id,path,suport,joint:,up,mass_kg\n"
        "a,x,,,north,heavy\n"
        "../b,,,,,\n"
        "c,x,,,,\n"
        "d,x,,,,,too,many\n"
        "C,x,,,,\n"
        'e,"x\n',
    )
    text = "asset_id,scale,size_m,joint:lid,material:body\nc,1,2,ajar,steal\nzz,1,,,\nc,-1,,,\n"
    (data / "overrides.csv").write_text(text)
    with pytest.raises(UsageError) as caught:
        load_dataset(data)
    found = [
        "manifest.csv: column 'joint:' names nothing", "manifest.csv: column 'suport' is unknown",
        "line 2: up 'north'", "line 2, column 'mass_kg': 'heavy'",
        "line 3: asset_id '../b'", "line 3: asset '../b' has no path", "line 5: more cells than columns",
        "lines 4 and 6: asset_id c and C", "line 7: a quote opens here",
        "overrides.csv, line 2, column 'joint:lid': 'ajar'", "overrides.csv, line 2, column 'material:body': no",
        "overrides.csv, line 2: columns 'scale' and 'size_m'", "overrides.csv, line 4: asset 'c' stands in line 2",
    ]  # fmt: skip
    said = str(caught.value).splitlines()
    assert said[0] == f"{len(found)} mistakes:" and len(said) == len(found) + 1, caught.value
    for words in found:
        assert sum(words in line for line in said) == 1, (words, caught.value)


def test_of_very_many_mistakes_the_first_are_said_and_the_others_counted(tmp_path: Path) -> None:
    rows = "".join(f"a{number},x,up there\n" for number in range(5000))
    with pytest.raises(UsageError) as caught:
        load_dataset(write_manifest(tmp_path, f"asset_id,path,up\n{rows}"))
    said = str(caught.value).splitlines()
    assert said[0] == "5000 mistakes:" and said[-1].strip() == f"… and {5000 - MOST_MISTAKES} more"
    assert len(said) == MOST_MISTAKES + 2 and "line 2: up 'up there'" in said[1]


def test_folders_whose_names_differ_in_case_only_are_refused(tmp_path: Path) -> None:
    for name in ("Box", "box"):
        write_urdf(tmp_path / name)
    with pytest.raises(UsageError, match="asset_id Box and box name the same folder"):
        load_dataset(tmp_path)


def test_a_column_that_nothing_reads_is_said_and_hinders_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    data = write_manifest(tmp_path, 'asset_id,path,licence,prompt,\na,b,MIT,"Two\nlines, ""quoted"".",\n')
    (ref,) = load_dataset(data)
    assert ref.prompt == 'Two\nlines, "quoted".'
    assert "nothing reads column licence" in caplog.text
