"""Datasets behind URLs: found and hashed from listings, fetched as far as they changed, and bad ones are rows."""

import shutil
from pathlib import Path

import pytest

from asset2sim.catalog.read import read_table
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.url_files import fetch_asset, local_file
from asset2sim.runs.asset_attempt import AssetAttempt
from asset2sim.runs.check_request import check_request
from asset2sim.runs.plan.plan import asset_files_hashes
from asset2sim.runs.plan.state import open_state
from asset2sim.runs.remote.output import open_output
from asset2sim.runs.remote.transfer import fetched, run_with_local_files, with_local_packages
from asset2sim.runs.request import RefineRequest
from asset2sim.storage import tree
from asset2sim.storage.objects import data_root, working_folder
from schemas.asset import AssetRef
from schemas.errors import UsageError
from schemas.inputs import InputSettings
from schemas.location import Location
from schemas.vocabulary import FailureMode, Method, Status
from tests.factories import make_finding, make_record
from tests.incremental_runs import NO_VIEWS, dataset
from tests.object_store import Store
from tests.remote_runs import in_this_process, night

OUTER = '<robot name="a"><mesh filename="package://kit/shared/part.obj"/><mesh filename="meshes/own.obj"/></robot>'


@pytest.fixture(autouse=True)
def nothing_listed(store: Store) -> None:
    tree._kept.clear()


def with_outer(folder: Path) -> Path:
    """A dataset whose asset ``a`` takes a mesh with its looks from beside it."""
    dataset(folder)
    (folder / "a" / "mobility.urdf").write_text(OUTER)
    (folder / "a" / "meshes").mkdir()
    (folder / "a" / "meshes" / "own.obj").write_text("o own")
    (folder / "shared").mkdir()
    for name in ("part.obj", "part.mtl", "wood.png", "other.obj"):
        (folder / "shared" / name).write_text(name)
    return folder


def test_a_location_is_a_folder_or_a_url() -> None:
    assert Location("data/raw/") == "data/raw" == Location(Path("data/raw")) and Location("data/raw").folder == Path(
        "data/raw"
    )
    assert Location("file:///data/raw").folder == Path("/data/raw")
    assert Location("S3://bucket//a b/") == "s3://bucket/a b" == Location("s3://bucket/a b").absolute()
    assert Location("s3://b/x").below("assets", "1") == "s3://b/x/assets/1" and Location("x").below("1") == "x/1"
    assert Location("gs://b").is_url and not Location("C:/x").is_url
    assert (
        Location("s3://b/x").is_within("s3://b")
        and not Location("s3://bb").is_within("s3://b")
        and not Location("s3://b").is_within(Path("/"))
    )
    for wrong in ("s3://", "s3://b/../c", "simplecache::s3://b"):
        with pytest.raises(UsageError, match="s3://bucket/prefix"):
            Location(wrong)
    with pytest.raises(UsageError, match="leave the password out") as told:
        Location("ftp://me:hunter22@host/x")
    assert "hunter22" not in str(told.value)
    request = RefineRequest.model_validate({"data": "s3://b/x/", "out": "out"})
    assert (request.data, request.out) == ("s3://b/x", "out")
    assert RefineRequest.model_validate_json(request.model_dump_json()) == request
    with pytest.raises(UsageError, match="folder of this machine"):
        _ = Location("s3://b/x").folder


def test_a_folder_named_by_text_is_a_folder(tmp_path: Path) -> None:
    assert working_folder(str(tmp_path)) == tmp_path and local_file(Location(str(tmp_path))) == tmp_path
    with open_output(str(tmp_path)) as output:
        assert (output.folder, output.url) == (tmp_path, None)
    with pytest.raises(UsageError, match="no catalog in"):
        read_table(str(tmp_path), "assets")


@pytest.mark.parametrize("layout", ["manifest", "one level", "two levels", "one asset"])
def test_a_dataset_is_found_as_on_this_machine(store: Store, tmp_path: Path, layout: str) -> None:
    data = tmp_path / "data"
    dataset(data / "Box" if layout == "two levels" else data)
    if layout != "manifest":
        for manifest in data.rglob("manifest.csv"):
            manifest.unlink()
    (data / ".hidden").mkdir()
    (data / ".hidden" / "x.urdf").write_text("<robot/>")
    robot = data / "packaged" / "urdf"
    robot.mkdir(parents=True)
    (robot / "r.urdf").write_text("<robot/>")
    data = data / "a" if layout == "one asset" else data
    url = f"{store.url}/some/set"
    store.put(data, url)
    here, there = load_dataset(data), load_dataset(url)
    assert [ref.path for ref in there] == [ref.path.replace(str(data), url) for ref in here]
    if layout != "one asset":
        placeless = {"path": "", "root": ""}
        assert [ref.model_copy(update=placeless) for ref in there] == [ref.model_copy(update=placeless) for ref in here]
        assert {ref.root for ref in there} == {url} and {ref.root for ref in here} == {str(data)}


def test_what_is_no_dataset_is_a_mistake_in_one_line(store: Store, tmp_path: Path) -> None:
    store.files.pipe_file(f"{store.url}/x/file.txt", b"")
    store.files.pipe_file(f"{store.url}/m/manifest.csv", b"asset_id,path\na,../../elsewhere/a\n")
    for url, told in (
        (f"{store.url}/none", "holds nothing"),
        (f"{store.url}/x/file.txt", "is an object"),
        (f"{store.url}/x", "neither manifest.csv, nor a URDF"),
        ("s3://no-such-bucket/x", "check the address"),
        (f"{store.url}/m", "leaves the bucket"),
    ):
        with pytest.raises(UsageError, match=told) as raised:
            load_dataset(url)
        assert "\n" not in str(raised.value)
    store.put(dataset(tmp_path / "data"), f"{store.url}/data")
    for out, told in (
        ("s3://no-such-bucket/x", "check the address"),
        (f"{store.url}/data", "is the dataset itself"),
        (f"{store.url}/data/a/out", "overlap"),
    ):
        with pytest.raises(UsageError, match=told):
            check_request(f"{store.url}/data", out, NO_VIEWS, None, (), None)
    assert not (tmp_path / "cache").exists(), "something was written before the request was found to be wrong"


def test_contents_are_hashed_from_listings_alone(store: Store, tmp_path: Path) -> None:
    data = with_outer(tmp_path / "data")
    url = f"{store.url}/set"
    store.put(data, url)
    refs = load_dataset(url)
    by_id: dict[str, str] = {}

    def hashes() -> dict[str, str]:
        tree._kept.clear()
        with open_state(tmp_path / "out") as state:
            found = asset_files_hashes(state, refs)
        by_id.update({ref.asset_id: found[ref.path] for ref in refs})
        return dict(by_id)

    urdfs = sorted(f"set/{name}/mobility.urdf" for name in "abcd")
    assert sorted(store.asked("GET", hashes)) == urdfs, "each URDF once, for what it refers to elsewhere"
    first = dict(by_id)
    assert store.asked("GET", hashes) == [] and by_id == first and len(set(first.values())) == 4
    for change, moved in (
        ("shared/part.obj", "a"), ("shared/wood.png", "a"), ("shared/other.obj", ""), ("a/meshes/own.obj", "a"),
        ("b/mobility.urdf", "b"), ("c/.hidden", ""), ("d/new.txt", "d"),
    ):  # fmt: skip
        before = hashes()
        store.files.pipe_file(f"{url}/{change}", b"changed")
        after = hashes()
        assert "".join(name for name in "abcd" if after[name] != before[name]) == moved, change
    # The hash is of what is there, not of where or of how it was looked at.
    tree._kept.clear()
    with open_state(tmp_path / "other") as state:
        alone = asset_files_hashes(state, refs[:1])
    assert alone == {refs[0].path: by_id["a"]}


def test_an_asset_is_fetched_as_far_as_it_changed(store: Store, tmp_path: Path) -> None:
    url = f"{store.url}/set"
    store.put(with_outer(tmp_path / "data"), url)
    folder = f"{url}/a"
    got = sorted(store.asked("GET", lambda: fetch_asset(folder)))
    outer = [f"set/shared/{name}" for name in ("part.mtl", "part.obj", "wood.png")]
    assert got == ["set/a/meshes/own.obj", "set/a/mobility.urdf", *outer]
    place = data_root() / "s3" / folder.removeprefix("s3://")
    assert (place / "mobility.urdf").read_text() == OUTER
    assert store.asked("GET", lambda: fetch_asset(folder)) == []
    store.files.rm(f"{folder}/meshes/own.obj")
    store.files.pipe_file(f"{folder}/new.txt", b"new")
    assert store.asked("GET", lambda: fetch_asset(folder)) == ["set/a/new.txt"]
    assert sorted(path.name for path in place.rglob("*")) == ["mobility.urdf", "new.txt"]
    store.files.rm(folder, recursive=True)
    fetch_asset(folder)
    assert not place.exists()
    # The experts' choices lie above the assets.
    store.files.pipe_file(f"{url}/reference.csv", b"asset_id\n")
    ref = AssetRef(asset_id="b", path=f"{url}/b", root=url)
    experts = NO_VIEWS.model_copy(update={"method": Method.REFERENCE})
    for settings in (NO_VIEWS, experts):
        local = Path(fetched(ref, settings).path)
        assert local.parent.joinpath("reference.csv").is_file() == (settings is experts)
    assert local_file(Location(f"{url}/reference.csv")).read_text() == "asset_id\n"


def test_what_lies_outside_a_dataset_in_its_bucket_is_not_fetched(store: Store, tmp_path: Path) -> None:
    """As on this machine: neither fetched nor hashed, unless it is allowed or a named package's."""
    url = f"{store.url}/set"
    store.put(with_outer(tmp_path / "data"), url)
    (asset,) = load_dataset(f"{url}/a")
    whole = next(ref for ref in load_dataset(url) if ref.asset_id == "a")
    allowed, named = InputSettings(allow_outside=True), InputSettings(packages=(f"kit={url}",))
    assert (asset.root, whole.root) == (f"{url}/a", url)

    def hashes(ref: AssetRef, inputs: InputSettings) -> str:
        tree._kept.clear()
        with open_state(tmp_path / "out") as state:
            return asset_files_hashes(state, [ref], inputs)[ref.path]

    def brought(ref: AssetRef, inputs: InputSettings) -> bool:
        got = store.asked("GET", lambda: fetched(ref, NO_VIEWS.model_copy(update={"inputs": inputs})))
        return any("shared" in name for name in got)

    before = hashes(asset, InputSettings())
    assert before not in {hashes(whole, InputSettings()), hashes(asset, allowed), hashes(asset, named)}
    assert not brought(asset, InputSettings())
    local = fetched(asset, NO_VIEWS)
    assert local.root == local.path == str(data_root() / "s3" / f"{url}/a".removeprefix("s3://"))
    assert brought(asset, named)
    store.files.pipe_file(f"{url}/shared/part.obj", b"changed")
    assert hashes(asset, InputSettings()) == before and brought(whole, InputSettings())
    local_kit = with_local_packages(NO_VIEWS.model_copy(update={"inputs": named})).inputs.package_folders["kit"]
    assert Path(local_kit, "shared", "part.obj").read_bytes() == b"changed"


def test_an_asset_outside_its_dataset_is_not_fetched(store: Store, tmp_path: Path) -> None:
    store.put(dataset(tmp_path / "data"), f"{store.url}/set")
    store.files.pipe_file(f"{store.url}/list/manifest.csv", b"asset_id,path\na,../set/a\n")
    (ref,) = load_dataset(f"{store.url}/list")
    assert store.asked("GET", lambda: fetched(ref, NO_VIEWS)) == []
    with open_state(tmp_path / "out") as state:
        assert asset_files_hashes(state, [ref]) == {ref.path: "outside"}


def test_what_cannot_be_fetched_is_the_assets_failure(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    ref = AssetRef(asset_id="a", path="s3://no-such-bucket/a")
    attempt = run_with_local_files(ref, Location("out"), NO_VIEWS, lambda _: pytest.fail("it was refined"))
    assert attempt.record.failure_mode is FailureMode.UNREADABLE_ASSET and attempt.record.status is Status.FAILED
    assert attempt.record.reason.startswith("s3://no-such-bucket/a: not there") and not attempt.died
    # A store that is away is the day's fault: the next run tries again.
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:1")
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    type(store.files).clear_instance_cache()
    attempt = run_with_local_files(ref, Location("out"), NO_VIEWS, lambda _: pytest.fail("it was refined"))
    assert attempt.record.failure_mode is FailureMode.ENGINE_CRASH
    type(store.files).clear_instance_cache()


def test_a_record_speaks_of_urls(store: Store, tmp_path: Path) -> None:
    store.put(dataset(tmp_path / "data"), f"{store.url}/set")
    ref = load_dataset(f"{store.url}/set")[0]

    def work(local: AssetRef) -> AssetAttempt:
        assert (Path(local.path) / "mobility.urdf").is_file()
        finding = make_finding("warning", "x").model_copy(update={"message": f"{local.path}/mobility.urdf: odd"})  # type: ignore[arg-type]
        return AssetAttempt(make_record("a", ref=local, reason=f"{local.path}: bad", findings=(finding,)))

    record = run_with_local_files(ref, Location(tmp_path / "out"), NO_VIEWS, work).record
    assert record.ref == ref and record.reason == f"{store.url}/set/a: bad"
    assert record.findings[0].message == f"{store.url}/set/a/mobility.urdf: odd"


def test_a_manifests_missing_folder_is_a_row_as_on_this_machine(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_this_process(monkeypatch)
    data = dataset(tmp_path / "data")
    shutil.rmtree(data / "b")
    store.put(data, f"{store.url}/set")
    tables = []
    for place, out in ((data, tmp_path / "here"), (f"{store.url}/set", tmp_path / "there")):
        night(place, out)
        rows = read_table(out, "assets")[["asset_id", "status", "failure_mode", "reason", "source_path"]]
        tables.append(rows.to_csv().replace(str(place), "DATA"))
    assert tables[0] == tables[1] and "DATA/b: no such asset folder" in tables[1]
