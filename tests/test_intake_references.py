"""Nothing comes in from outside: what an asset names beyond its dataset is a finding, and neither read nor copied."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.mesh_files import MAX_LIBRARY_BYTES, copy_meshes
from asset2sim.assets.urdf.references import AllowedFolders, allowed_folders
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.formats.xacro import urdf_of_xacro
from asset2sim.intake.origin import extract, open_origin
from asset2sim.runs.plan.plan import asset_files_hashes
from asset2sim.runs.plan.state import open_state
from schemas.asset import AssetRef
from schemas.errors import AssetError
from schemas.finding import Finding
from schemas.inputs import InputSettings
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, FailureMode, Method, UpAxis
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, box_obj, fingerprint, joint, link, mesh, prior, robot, written

BOX = box_obj((0, 0, 0), (1, 1, 1))
SECRET = box_obj((0, 0, 0), (7, 7, 7), "o secret\n")
ALLOWED = InputSettings(allow_outside=True)


def dataset(root: Path, reference: str, files: dict[str, str | bytes] | None = None) -> AssetRef:
    """A dataset ``root/data`` whose asset ``Box/a`` has a box and what ``reference`` means; outside lies a secret."""
    written(root / "outside", "", {"x.obj": SECRET, "x.mtl": "newmtl m\nmap_Kd x.png\n", "x.png": b"\x89PNG secret"})
    (root / "outside" / "mobility.urdf").unlink()
    body = link("body", mesh("own.obj") + mesh(reference.format(root=root)))
    written(root / "data" / "Box" / "a", robot(body), {"own.obj": BOX, **(files or {})})
    return load_dataset(root / "data")[0]


def told(item: Extraction, code: str = "outside_dataset") -> Finding:
    """The one finding of what is not read."""
    (found,) = [finding for finding in item.findings if finding.code == code]
    return found


def copied(item: Extraction, target: Path) -> bytes:
    """All bytes of what the asset's meshes are copied as."""
    copy_meshes(item.mesh_files, item.source.parent, target)
    return b"".join(path.read_bytes() for path in target.rglob("*") if path.is_file())


@pytest.mark.parametrize(
    "reference",
    [
        "../../../outside/x.obj",
        "{root}/outside/x.obj",
        "file://{root}/outside/x.obj",
        "file:///../{root}/outside/x.obj",
        "package://../../../outside/x.obj",
        "package://a/../../../../outside/x.obj",
        "model://..\\..\\..\\outside\\x.obj",
        "own.obj/../../../../outside/x.obj",
        "linked.obj",
        "linked/x.obj",
    ],
)
def test_a_mesh_outside_is_a_finding_and_a_missing_mesh(tmp_path: Path, reference: str) -> None:
    ref = dataset(tmp_path, reference)
    (Path(ref.path) / "linked.obj").symlink_to("../../../outside/x.obj")
    (Path(ref.path) / "linked").symlink_to(tmp_path / "outside")
    item = extract(ref)
    if reference.startswith("own.obj/"):  # the system finds nothing below a file
        assert [finding.code for finding in item.findings if finding.link] == ["missing_mesh"]
    else:
        found = told(item)
        assert found.link == "body" and f"'{reference.format(root=tmp_path)}'" in found.message
        assert str(tmp_path / "data") in found.message and "--package" in found.message
        assert "--allow-outside" in found.message
        assert ("a link to" in found.message) == (reference == "linked.obj")
    assert b"secret" not in copied(item, tmp_path / "out")
    assert max(item.features.rest_size) == pytest.approx(1.0)
    if not reference.startswith("own.obj/"):
        allowed = extract(ref, inputs=ALLOWED)
        assert max(allowed.features.rest_size) == pytest.approx(7.0) and allowed.findings == ()


def test_what_is_read_later_is_told_nothing_of_what_lies_outside(tmp_path: Path) -> None:
    """Views and engines read the URDF by themselves: it must not lead there."""
    ref = dataset(tmp_path, "../../../outside/x.obj")
    opened = open_origin(Path(ref.path), reach=allowed_folders(ref, InputSettings()))
    assert b"../outside" not in opened.urdf.read_bytes() and str(tmp_path / "outside") not in opened.urdf.read_text()
    assert b"own.obj" in opened.urdf.read_bytes() and opened.file == Path(ref.path) / "mobility.urdf"


def test_a_link_that_has_nothing_else_fails_and_says_why(tmp_path: Path) -> None:
    urdf = robot(link("body", mesh("own.obj")), link("lid", mesh("../x.obj")), joint("j", "fixed", "body", "lid"))
    written(tmp_path / "data" / "a", urdf, {"own.obj": BOX})
    (tmp_path / "data" / "x.obj").write_text(SECRET)
    root = tmp_path / "data" / "a"
    with pytest.raises(AssetError, match=r"'lid'.*'\.\./x\.obj'.*lies outside.*--allow-outside") as caught:
        extract(load_dataset(root)[0])
    assert (caught.value.mode, caught.value.link) == (FailureMode.MISSING_MESH, "lid")
    assert extract(load_dataset(tmp_path / "data")[0]).findings == (), "below the dataset's root it is inside"


@pytest.mark.parametrize("what", ["library", "picture", "linked library", "collada", "gltf buffer", "gltf picture"])
def test_what_a_mesh_names_outside_is_not_read(tmp_path: Path, what: str) -> None:
    up = "../../../outside"
    reference = {"collada": "b.dae", "gltf buffer": "b.gltf", "gltf picture": "b.gltf"}.get(what, "b.obj")
    head = {"library": f"mtllib {up}/x.mtl\n", "picture": "mtllib b.mtl\n", "linked library": "mtllib l.mtl\n"}
    ref = dataset(tmp_path, reference, {"b.obj": box_obj((0, 0, 0), (2, 2, 2), head.get(what, ""))})
    folder = Path(ref.path)
    (folder / "b.mtl").write_text(f"newmtl m\nmap_Kd {up}/x.png\n")
    (folder / "l.mtl").symlink_to(f"{up}/x.mtl")
    (folder / "b.dae").write_text(collada(f"{up}/x.png"))
    tree = {"asset": {"version": "2.0"}, "buffers": [{"uri": f"{up}/x.obj", "byteLength": 9}]}
    if what == "gltf picture":
        tree = {"asset": {"version": "2.0"}, "images": [{"uri": f"{up}/x.png"}]}
    (folder / "b.gltf").write_text(json.dumps(tree))
    item = extract(ref)
    found = told(item)
    assert found.link == "body" and reference in found.message and "outside/x." in found.message
    content = copied(item, tmp_path / "out")
    assert b"secret" not in content and b"outside" not in content
    broken = what.startswith("gltf")
    assert max(item.features.rest_size) == pytest.approx(1.0 if broken else 2.0), "a mesh without looks is a mesh"
    assert (None in item.mesh_files.values()) == broken


@pytest.mark.parametrize("what", ["library", "picture", "picture after options", "large library"])
def test_materials_that_no_engine_could_finish_reading_are_left_out(tmp_path: Path, what: str) -> None:
    ref = dataset(tmp_path, "b.obj", {"b.obj": box_obj((0, 0, 0), (2, 2, 2), "mtllib b.mtl\n")})
    library, pipe = Path(ref.path) / "b.mtl", Path(ref.path) / "p.png"
    os.mkfifo(library if what == "library" else pipe)
    if what != "library":
        options = "-bm 1 " if what == "picture after options" else ""
        library.write_text(f"newmtl m\nmap_Kd {options}p.png\n" if what != "large library" else "")
    if what == "large library":
        os.truncate(library, MAX_LIBRARY_BYTES + 1)
    item = extract(ref)
    name, why = {"library": ("b.mtl", "is a pipe"), "large library": ("b.mtl", "over 16 MiB")}.get(
        what, ("p.png", "is a pipe")
    )
    found = told(item, "materials_unusable")
    assert found.link == "body" and f"'{name}' " in found.message and why in found.message
    assert b"mtllib" not in copied(item, tmp_path / "out")
    assert max(item.features.rest_size) == pytest.approx(2.0), "a mesh without looks is a mesh"


def collada(picture: str) -> str:
    """A tetrahedron 2 m large, painted with a picture."""
    points = "0 0 0 2 0 0 0 2 0 0 0 2"
    return f"""<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_images><image id="i"><init_from>{picture}</init_from></image></library_images>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="f" count="12">{points}</float_array>
<technique_common><accessor source="#f" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION"
source="#p"/></vertices><triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def test_a_texture_and_files_beside_the_urdf_that_are_links_outside_are_left_out(tmp_path: Path) -> None:
    ref = dataset(tmp_path, "own.obj")
    folder = Path(ref.path)
    painted = '<material name="m"><texture filename="../../../outside/x.png"/></material>'
    (folder / "mobility.urdf").write_text(robot(painted, link("body", mesh("own.obj"))))
    (tmp_path / "outside" / "labels").write_text("body heavy secret\n")
    (folder / "semantics.txt").symlink_to(tmp_path / "outside" / "labels")
    item = extract(ref)
    messages = [finding.message for finding in item.findings if finding.code == "outside_dataset"]
    assert len(messages) == 2 and any("texture" in text for text in messages)
    assert any("semantics.txt" in text for text in messages)
    assert item.features.links[0].label == "" and item.companions == {}
    assert b"secret" not in copied(item, tmp_path / "out")


@pytest.mark.parametrize("kind", ["folder", "urdf", "manifest"])
def test_an_asset_that_lies_outside_itself_is_a_row_that_says_so(tmp_path: Path, kind: str) -> None:
    elsewhere = written(tmp_path / "elsewhere" / "a", robot(link("body", mesh("own.obj"))), {"own.obj": BOX})
    data = tmp_path / "data"
    data.mkdir()
    if kind == "urdf":
        (data / "a").mkdir()
        (data / "a" / "mobility.urdf").symlink_to(elsewhere / "mobility.urdf")
    elif kind == "folder":
        (data / "a").symlink_to(elsewhere)
    else:
        (data / "manifest.csv").write_text("asset_id,path\na,../elsewhere/a\n")
    ref = load_dataset(data)[0]
    with pytest.raises(AssetError, match=r"lies outside the dataset.*--allow-outside") as caught:
        extract(ref)
    assert (caught.value.mode, caught.value.code) == (FailureMode.UNREADABLE_ASSET, "outside_dataset")
    if kind != "urdf":
        assert extract(ref, inputs=ALLOWED).findings == ()


def test_links_within_the_dataset_and_a_dataset_that_is_a_link_are_inside(tmp_path: Path) -> None:
    real = written(tmp_path / "disk" / "set" / "store" / "a", robot(link("body", mesh("shape.obj"))))
    (tmp_path / "disk" / "set" / "meshes").mkdir()
    (tmp_path / "disk" / "set" / "meshes" / "shape.obj").write_text(BOX)
    (real / "shape.obj").symlink_to("../../meshes/shape.obj")
    (tmp_path / "disk" / "set" / "by_name").symlink_to("store/a")
    (tmp_path / "disk" / "set" / "manifest.csv").write_text("asset_id,path\na,by_name\n")
    (tmp_path / "data").symlink_to("disk/set")
    for data in (tmp_path / "data", tmp_path / "disk" / "set"):
        item = extract(load_dataset(data)[0])
        assert item.findings == () and item.features.links[0].volume_m3 == pytest.approx(1.0)


def test_a_named_package_is_read_and_no_more_than_it(tmp_path: Path) -> None:
    ref = dataset(tmp_path, "package://things/x.obj")
    plain = extract(ref)
    assert any("--package things=PATH" in finding.message for finding in plain.findings)
    named = InputSettings(packages=(f"things={tmp_path / 'outside'}",))
    item = extract(ref, inputs=named)
    assert item.findings == () and max(item.features.rest_size) == pytest.approx(7.0)
    leaving = dataset(tmp_path / "more", "package://things/../../outside/x.obj")
    within = InputSettings(packages=(f"things={Path(leaving.path)}",))
    assert told(extract(leaving, inputs=within)).link == "body"


def test_a_urdf_that_lies_on_its_side_is_confined_as_well(tmp_path: Path) -> None:
    item = extract(dataset(tmp_path, "../../../outside/x.obj"), up=UpAxis.Y)
    assert told(item).link == "body" and max(item.features.rest_size) == pytest.approx(1.0)


XACRO = '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro">{}<link name="body">{}</link></robot>'


@pytest.mark.parametrize(
    "inside",
    [
        '<xacro:include filename="../../../outside/secret.xacro"/>',
        '<xacro:include filename="{root}/outside/*.xacro"/>',
        '<xacro:include filename="linked.xacro"/>',
        '<xacro:property name="y" value="${{xacro.load_yaml(\'{root}/outside/secret.yaml\')}}"/>${{y}}',
    ],
)
def test_a_xacro_includes_nothing_from_outside(tmp_path: Path, inside: str) -> None:
    ref = dataset(tmp_path, "own.obj")
    folder = Path(ref.path)
    (tmp_path / "outside" / "secret.xacro").write_text("<robot><!-- secret --></robot>")
    (tmp_path / "outside" / "secret.yaml").write_text("secret: 1\n")
    (folder / "linked.xacro").symlink_to(tmp_path / "outside" / "secret.xacro")
    (folder / "mobility.urdf").rename(folder / "gone")
    (folder / "a.urdf.xacro").write_text(XACRO.format(inside.format(root=tmp_path), mesh("own.obj")))
    with pytest.raises(AssetError, match=r"a\.urdf\.xacro.*lies outside.*--allow-outside"):
        extract(ref)
    assert extract(ref, inputs=ALLOWED).features.root


@pytest.mark.system
@pytest.mark.parametrize(
    "model",
    [
        '<asset><mesh name="m" file="../../../outside/x.obj"/></asset>',
        '<compiler meshdir="../../../outside"/><asset><mesh name="m" file="x.obj"/></asset>',
        '<compiler meshdir="{root}/outside"/><asset><mesh name="m" file="x.obj"/></asset>',
        '<include file="more.xml"/>',
        '<include file="../../../outside/part.xml"/>',
        '<asset><mesh name="m" file="linked.obj"/></asset>',
    ],
)
def test_an_mjcf_names_nothing_outside(tmp_path: Path, model: str) -> None:
    pytest.importorskip("mujoco")
    ref = dataset(tmp_path, "own.obj")
    folder = Path(ref.path)
    (folder / "mobility.urdf").rename(folder / "gone")
    asset = '<mujoco><asset><mesh name="m" file="../../../outside/x.obj"/></asset></mujoco>'
    (folder / "more.xml").write_text(asset)
    (tmp_path / "outside" / "part.xml").write_text("<mujoco/>")
    (folder / "linked.obj").symlink_to(tmp_path / "outside" / "x.obj")
    body = '<worldbody><body name="b"><geom type="box" size="1 1 1"/></body></worldbody>'
    (folder / "model.xml").write_text(f"<mujoco>{model.format(root=tmp_path)}{body}</mujoco>")
    with pytest.raises(AssetError, match=r"model\.xml.*lies outside.*--allow-outside") as caught:
        extract(ref)
    assert caught.value.code == "outside_dataset"


@pytest.mark.system
def test_an_mjcf_goes_without_pictures_that_lie_outside(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    ref = dataset(tmp_path, "own.obj")
    folder = Path(ref.path)
    (folder / "mobility.urdf").rename(folder / "gone")
    (tmp_path / "outside" / "wood.png").write_bytes(b"no picture")
    asset = (
        '<asset><texture name="t" type="2d" file="../../../outside/wood.png"/><material name="m" texture="t"/></asset>'
    )
    body = '<worldbody><body name="b"><geom type="box" size="1 1 1" material="m"/></body></worldbody>'
    (folder / "model.xml").write_text(f"<mujoco>{asset}{body}</mujoco>")
    found = extract(ref)
    assert found.features.rest_size == pytest.approx((2.0, 2.0, 2.0))
    assert any("texture 't' is left out: its file 'wood.png' is" in item.message for item in found.findings)


def test_what_lies_within_its_package_or_beside_its_model_is_inside(tmp_path: Path) -> None:
    """Named as a file, as the ``urdf`` folder or as the package; of Gazebo's models one may need another."""
    package, models = tmp_path / "pkg", tmp_path / "models"
    for name in ("a", "b"):
        written(package / "urdf", robot(link("body", mesh(f"../meshes/{name}.obj"))))
        (package / "urdf" / "mobility.urdf").rename(package / "urdf" / f"{name}.urdf")
    written(package / "meshes", "", {"a.obj": BOX, "b.obj": BOX})
    for model in ("door", "handle"):
        written(models / model, robot(link("body", mesh(f"model://handle/{model}.obj"))), {"model.config": ""})
        (models / "handle").mkdir(exist_ok=True)
        (models / "handle" / f"{model}.obj").write_text(BOX)
    for data in (package, package / "urdf", package / "urdf" / "a.urdf", models / "door"):
        for ref in load_dataset(data):
            assert not [item for item in extract(ref).findings if item.code in ("outside_dataset", "missing_mesh")]
    (a, b), inputs = load_dataset(package), InputSettings()
    before = [digest(ref, inputs, tmp_path / "out") for ref in (a, b)]
    (package / "meshes" / "a.obj").write_text(BOX + "# changed\n")
    after = [digest(ref, inputs, tmp_path / "out") for ref in (a, b)]
    assert before[0] != after[0] and before[1] == after[1], "a file's asset is what the file refers to"


def digest(ref: AssetRef, inputs: InputSettings, out: Path) -> str:
    with open_state(out) as state:
        return asset_files_hashes(state, [ref], inputs)[ref.path]


@pytest.mark.parametrize("how", ["reference", "link", "folder link", "material"])
def test_what_is_not_read_does_not_count_and_what_may_be_read_does(tmp_path: Path, how: str) -> None:
    head = "mtllib ../outside/x.mtl\n" if how == "material" else ""
    reference = {"reference": "../../../outside/x.obj", "material": "../../b.obj"}.get(how, "own.obj")
    ref = dataset(tmp_path, reference)
    (tmp_path / "data" / "b.obj").write_text(head + BOX)
    if how == "link":
        (Path(ref.path) / "b.obj").symlink_to(tmp_path / "outside" / "x.obj")
    if how == "folder link":
        (Path(ref.path) / "more").symlink_to(tmp_path / "outside")

    def hashes() -> tuple[str, str]:
        return digest(ref, InputSettings(), tmp_path / "out"), digest(ref, ALLOWED, tmp_path / "out")

    before = hashes()
    assert before[0] != before[1], "allowing it refines the asset again"
    for name in ("x.obj", "x.mtl"):
        with (tmp_path / "outside" / name).open("a") as stream:
            stream.write("# changed\n")
    after = hashes()
    assert after[0] == before[0] and after[1] != before[1]
    bystander = dataset(tmp_path / "other", "own.obj")
    assert digest(bystander, InputSettings(), tmp_path / "out") == digest(bystander, ALLOWED, tmp_path / "out")


def test_a_linked_file_is_not_looked_into_to_choose_the_asset_s_own(tmp_path: Path) -> None:
    ref = dataset(tmp_path, "own.obj")
    folder = Path(ref.path)
    (folder / "mobility.urdf").rename(folder / "own.urdf")
    (folder / "more.urdf").symlink_to(tmp_path / "outside" / "x.obj")
    assert extract(ref).source.name == "own.urdf"


def test_what_a_moved_urdf_lacks_is_named_as_its_file_has_it(tmp_path: Path) -> None:
    ref = dataset(tmp_path, "../../../outside/x.obj")
    folder = Path(ref.path)
    more = mesh("gone.obj") + mesh("OWN.obj")
    (folder / "mobility.urdf").write_text((folder / "mobility.urdf").read_text().replace("</link>", f"{more}</link>"))
    item = extract(ref)
    said = {finding.message for finding in item.findings if finding.code == "missing_mesh"}
    assert len(said) == 1 and all("asset2sim-source" not in text and "outside" not in text for text in said)
    assert told(item).link == "body"
    spelt = [finding.message for finding in item.findings if finding.code == "spelt_otherwise"]
    assert len(spelt) == 1 and "'OWN.obj' is read from" in spelt[0] and "own.obj'" in spelt[0]


def test_a_reach_follows_links_and_survives_circles(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    reach = AllowedFolders(((tmp_path / "in").resolve(),))
    (tmp_path / "in" / "round").symlink_to("round")
    (tmp_path / "in" / "up").symlink_to("..")
    assert reach.allows(tmp_path / "in" / "x") and not reach.allows(tmp_path / "in" / "up" / "x")
    assert not reach.allows(tmp_path / "in" / "round") and not reach.allows(tmp_path / "inner")


def test_nothing_is_written_outside(tmp_path: Path) -> None:
    before: Callable[[], dict[str, str]] = lambda: fingerprint(tmp_path / "outside")  # noqa: E731
    ref = dataset(tmp_path, "../../../outside/x.obj")
    kept = before()
    copied(extract(ref), tmp_path / "out")
    copied(extract(ref, inputs=ALLOWED), tmp_path / "out2")
    assert before() == kept and sorted(os.listdir(tmp_path / "outside")) == ["x.mtl", "x.obj", "x.png"]


@pytest.mark.system
@pytest.mark.parametrize("method", [Method.ASSET2SIM, Method.DIRECT, Method.RAW])
def test_no_method_brings_anything_from_outside(tmp_path: Path, method: Method) -> None:
    """The whole way, each method's own: nothing of the secret in the output, and the size is the box's."""
    ref = dataset(tmp_path, "../../../outside/x.obj")
    (Path(ref.path) / "meta.json").symlink_to(tmp_path / "outside" / "x.mtl")
    engine = EngineSettings(verify=(Engine.PYBULLET,), interact=False)
    record = refine_asset(
        ref, tmp_path / "out", NO_VIEWS.model_copy(update={"method": method, "engine": engine}), prior
    )
    codes = {finding.code for finding in record.findings}
    assert "outside_dataset" in codes and "internal_error" not in codes
    assert record.features is not None and max(record.features.rest_size) == pytest.approx(1.0)
    written_files = [path for path in (tmp_path / "out").rglob("*") if path.is_file()]
    assert not [path for path in written_files if b"o secret" in path.read_bytes() or path.is_symlink()]
    assert bool(list((tmp_path / "out").glob("assets/*/mobility.urdf"))) == (method is not Method.RAW)


def test_a_xacro_does_not_learn_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It holds keys, and what a link is called comes into tables."""
    monkeypatch.setenv("SOME_KEY", "sk-of-the-environment")
    namespace = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
    for text in ("$(env SOME_KEY)", "${__import__('os').environ['SOME_KEY']}"):
        (tmp_path / "box.urdf.xacro").write_text(f'<robot name="a" {namespace}><link name="{text}"/></robot>')
        with pytest.raises(AssetError) as caught:
            urdf_of_xacro(tmp_path / "box.urdf.xacro", tmp_path, AllowedFolders((tmp_path,)))
        assert "sk-of" not in str(caught.value)
    (tmp_path / "box.urdf.xacro").write_text(
        f'<robot name="a" {namespace}><link name="$(optenv SOME_KEY none)"/></robot>'
    )
    assert (
        urdf_of_xacro(tmp_path / "box.urdf.xacro", tmp_path, AllowedFolders((tmp_path,))).robot[0].get("name") == "none"
    )
    assert urdf_of_xacro(tmp_path / "box.urdf.xacro", tmp_path).robot[0].get("name") == "sk-of-the-environment"


@pytest.mark.parametrize("reference", ["a/own.obj", "Box/a/own.obj"])
def test_a_path_from_a_folder_in_which_engines_search_is_found(reference: str, tmp_path: Path) -> None:
    item = extract(dataset(tmp_path, reference))
    assert not item.findings and reference in {mesh.file for mesh in item.features.links[0].meshes}
