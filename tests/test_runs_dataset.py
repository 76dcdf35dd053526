"""Datasets as users keep them: manifests with and without faults, bare folders, one asset."""

import inspect
from contextlib import nullcontext
from pathlib import Path

import pytest

from asset2sim.catalog.storage.tree import Tree, local_tree
from asset2sim.runs import dataset
from asset2sim.runs.dataset import check_asset_id, load_dataset
from asset2sim.runs.plan.plan import asset_files_hashes
from asset2sim.runs.plan.state import open_state
from flows import command
from flows.refine_dataset import refine_dataset
from flows.steps import discover
from schemas.errors import MISTAKE, UnknownChoiceError, UsageError
from schemas.vocabulary import UpAxis

SHARED = Path(__file__).resolve().parents[2] / "shared"


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


def test_a_byte_order_mark_and_spaced_headings_are_read(tmp_path: Path) -> None:
    (tmp_path / "manifest.csv").write_text("asset_id, path\na, Box/a\n", encoding="utf-8-sig")
    assert load_dataset(tmp_path)[0].path.endswith("Box/a")


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


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("id,path\na,b\n", "column asset_id missing; it has id, path"),
        ("", "column asset_id, path missing"),
        ("asset_id,path\n", "no rows"),
        ("asset_id,path\na,x\na,y\n", "asset_id a more than once"),
        ("asset_id,path\n../a,x\n", "line 2: asset_id '../a' holds '/'"),
        ("asset_id,path\n..,x\n", "may not be empty or start with"),
        ("asset_id,path\n,x\n", "may not be empty"),
        ("asset_id,path\na,\n", "line 2: asset 'a' has no path"),
        ("asset_id,path\na,b,c\n", "more cells than columns"),
    ],
)
def test_a_faulty_manifest_is_the_users_mistake(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(UsageError) as caught:
        load_dataset(write_manifest(tmp_path, text))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_manifest_in_another_encoding_is_the_users_mistake(tmp_path: Path) -> None:
    (tmp_path / "manifest.csv").write_bytes(b"asset_id,path\n\xff\xfe,x\n")
    with pytest.raises(UsageError, match="UTF-8"):
        load_dataset(tmp_path)


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


def test_a_missing_folder_names_what_is_there(tmp_path: Path) -> None:
    (tmp_path / "partnet").mkdir()
    with pytest.raises(UsageError, match=r"no dataset at .*partnt: .* has the folders partnet"):
        load_dataset(tmp_path / "partnt")


def test_a_folder_without_assets_and_a_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"neither manifest\.csv"):
        load_dataset(tmp_path)
    file = tmp_path / "x.urdf"
    file.write_text("", encoding="utf-8")
    with pytest.raises(UsageError, match="is a file"):
        load_dataset(file)


def test_real_names_are_safe_and_separators_are_not() -> None:
    assert check_asset_id("room73b2-toshiba clacio.v2_ü", "x") == "room73b2-toshiba clacio.v2_ü"
    for bad in ("a/b", "a\\b", "a\nb", ".hidden", " a", "x" * 300):
        with pytest.raises(UsageError):
            check_asset_id(bad, "x")


@pytest.mark.skipif(not (SHARED / "partnet_mobility").is_dir(), reason="the shared real objects are not here")
def test_the_real_manifest_and_the_same_folders_without_it() -> None:
    refs = load_dataset(SHARED / "partnet_mobility")
    assert len(refs) == 150
    assert len(load_dataset(SHARED / "partnet_mobility", subset="paper9")) == 9
    assert all(Path(ref.path).is_dir() for ref in refs)
    boxes = load_dataset(SHARED / "partnet_mobility" / "Box")
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
    monkeypatch.setattr("asset2sim.runs.isolation.children.warm_up", lambda pipeline: None)
    monkeypatch.setattr("asset2sim.models.gateway.lite.load_litellm", lambda: None)
    assert command.main(["refine", str(data), "--out", str(tmp_path / "out")]) == MISTAKE
    assert listed == [data.resolve()]
