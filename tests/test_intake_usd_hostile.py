"""USD that is broken, refers to itself or leads outside: an error that names the prim, nothing read from elsewhere."""

import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.references import allowed_folders
from asset2sim.intake.origin import extract, open_origin
from asset2sim.runs.plan.asset_files import asset_files
from schemas.asset import AssetRef
from schemas.errors import AssetError
from schemas.inputs import InputSettings
from schemas.vocabulary import FailureMode
from tests.origins import png
from tests.usd_stages import at, body, joint, limits, plate, prim, usda

pxr = pytest.importorskip("pxr", reason="usd-core is not installed")
BOX = plate("mesh", (0.3, 0.3, 0.3))
SECRET = usda(prim("Xform", "Thing", plate("mesh", (7.0, 7.0, 7.0))))
A, B = (body(name, at((x, 0.0, 0.0)), BOX, mass=1.0) for name, x in (("a", 0.0), ("b", 0.5)))
HINGE = joint(
    "Revolute", "hinge", ("/Thing/a", "/Thing/b"), limits(0.0, 90.0, "Z"), frame0="0.25 0 0", frame1="-0.25 0 0"
)


def dataset(root: Path, text: str | bytes, name: str = "thing.usda") -> AssetRef:
    """An asset ``data/one``, beside it a shared box, and outside of the dataset a secret."""
    for place, content in (
        (f"data/one/{name}", text),
        ("data/shared/box.usda", usda(prim("Xform", "Thing", BOX))),
        ("outside/x.usda", SECRET),
        ("outside/x.png", png(1, 2, 3)),
    ):
        file = root / place
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content if isinstance(content, bytes) else content.encode(errors="surrogateescape"))
    return AssetRef(asset_id="one", path=str(root / "data" / "one"), root=str(root / "data"))


def thing(*inside: str, more: str = "") -> str:
    return usda(prim("Xform", "Thing", *inside, more=more))


def read(root: Path, *inside: str, more: str = "") -> Extraction:
    return extract(dataset(root, thing(*inside, more=more)))


def refused(ref: AssetRef) -> AssetError:
    with pytest.raises(AssetError) as caught:
        extract(ref)
    assert caught.value.mode is FailureMode.UNREADABLE_ASSET
    return caught.value


def told(item: Extraction) -> str:
    return next(finding.message for finding in item.findings if finding.code == "converted_usd")


NAN = 'double3 xformOp:translate = (0, nan, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
FLAT = at((0, 0, 0), scale=(1, 0, 1))
BAD = BOX.replace("0, 1, 3, 2,", "0, 1, 3, 99,", 1)


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ("#usda 1.0\ndef", "usd_unreadable", "thing.usda"),
        ("no usd at all", "usd_unreadable", "thing.usda"),
        ("", "usd_unreadable", "thing.usda"),
        (thing(), "usd_empty", "no rigid body and no geometry"),
        (thing(A, B), "usd_objects", "(a, b): cut it by --split"),
        (thing(A, B, HINGE.replace("</Thing/b>", "</Thing/a/mesh>")), "usd_joint", "/Thing/a to itself"),
        (thing(A, B, HINGE.replace("</Thing/b>", "</Thing/gone>")), "usd_joint", "/Thing/gone is not there"),
        (thing(prim("Xform", "g", NAN, A)), "usd_number", "/Thing/g"),
        (thing(prim("Xform", "g", FLAT, A)), "usd_number", "/Thing/g/a has a scale of 0"),
        (thing(A, B, HINGE.replace("(0.25, 0.0, 0.0)", "(0.25, nan, 0.0)")), "usd_number", "/Thing/hinge"),
        (thing(A, B, HINGE.replace("= 90.0", "= nan")), "usd_number", "'physics:upperLimit' of /Thing/hinge"),
        (thing(A.replace("physics:mass = 1.0", "physics:mass = nan")), "usd_number", "'physics:mass' of /Thing/a"),
        (thing(A.replace("(1.0, 1.0, 1.0)", "(1, nan, 1)")), "usd_number", "/Thing/a"),
        (thing(BAD), "usd_mesh", "/Thing/mesh"),
        (thing(BOX.replace("[(-0.15,", "[(nan,", 1)), "usd_mesh", "/Thing/mesh has vertices that are not finite"),
        (thing(A, more="prepend references = </Thing>"), "usd_cycle", "/Thing"),
        (thing(A, more="prepend references = @./thing.usda@"), "usd_cycle", "/Thing refers to itself"),
        (thing(A).replace("defaultPrim", "subLayers = [@./gone.usda@]\ndefaultPrim"), "usd_layer", "gone.usda"),
        (usda(A, metres=0.0, default="a"), "usd_number", "metersPerUnit"),
        (usda(A, metres=1e300, default="a"), "usd_number", "metersPerUnit"),
        (
            thing(A, B, HINGE.replace('"Z"', '"W"')),
            "usd_axis",
            "'physics:axis' of /Thing/hinge is 'W': state X, Y or Z",
        ),
        (thing(prim("Cylinder", "c", 'token axis = "up"')), "usd_axis", "'axis' of /Thing/c is 'up'"),
        (thing(prim("Cylinder", "c", "double radius = 1e308")), "usd_number", "/Thing/c is over 1e+07 m large"),
        (thing(prim("Sphere", "c", "double radius = nan")), "usd_number", "/Thing/c is over 1e+07 m large"),
        ('#usda 1.0\ndef Xform "\udcf2" {}', "usd_unreadable", "it is no UTF-8"),
    ],
)
def test_what_no_urdf_can_be_made_of_names_the_prim(tmp_path: Path, text: str, code: str, said: str) -> None:
    error = refused(dataset(tmp_path, text))
    assert error.code == code and said in str(error) and "thing.usda" in str(error), str(error)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.6, 0.9])
@pytest.mark.parametrize("suffix", [".usdc", ".usdz", ".usd"])
def test_a_truncated_file_is_unreadable(tmp_path: Path, suffix: str, share: float) -> None:
    from pxr import Sdf, UsdUtils

    dataset(tmp_path, thing(A, B, HINGE))
    whole = tmp_path / "data" / "one" / "thing.usda"
    binary = tmp_path / "data" / "one" / "thing.usdc"
    Sdf.Layer.FindOrOpen(str(whole)).Export(str(binary))
    if suffix == ".usdz":
        UsdUtils.CreateNewUsdzPackage(str(binary), str(binary.with_suffix(suffix)))
    content = binary.with_suffix(suffix if suffix == ".usdz" else ".usdc").read_bytes()
    for file in (*whole.parent.iterdir(),):
        file.unlink()
    cut = whole.with_suffix(suffix)
    cut.write_bytes(content[: int(share * len(content))])
    error = refused(AssetRef(asset_id="one", path=str(whole.parent), root=str(tmp_path / "data")))
    assert error.code == "usd_unreadable" and cut.name in str(error)
    cut.unlink()
    cut.with_stem("again").write_bytes(content)
    assert len(extract(AssetRef(asset_id="one", path=str(whole.parent))).features.links) == 2


@pytest.mark.parametrize(
    "text",
    [
        thing(more="prepend references = @../../outside/x.usda@"),
        thing(more="prepend payload = @{root}/outside/x.usda@"),
        thing(more="prepend references = @parts/linked.usda@"),
        thing().replace("defaultPrim", "subLayers = [@../../outside/x.usda@]\ndefaultPrim"),
        thing(
            'variantSet "v" = {\n"far" (prepend references = @../../outside/x.usda@) {\n}\n}',
            BOX,
            more='prepend variantSets = "v"',
        ),
        thing(BOX, more='prepend references = @`"../../outside/${{X}}.usda"`@'),
        thing(BOX, more="clips = {{\ndictionary default = {{\nasset[] assetPaths = [@../../outside/x.usda@]\n}}\n}}"),
        thing(prim("Xform", "deep", more="prepend references = @../shared/far.usda@")),
    ],
)
def test_no_layer_outside_is_read(tmp_path: Path, text: str) -> None:
    ref = dataset(tmp_path, text.replace("{root}", str(tmp_path)).replace("{{", "{").replace("}}", "}"))
    if "linked" in text:
        (Path(ref.path) / "parts").mkdir()
        (Path(ref.path) / "parts" / "linked.usda").symlink_to(tmp_path / "outside" / "x.usda")
    (tmp_path / "data" / "shared" / "far.usda").write_text(thing(more="prepend references = @../../outside/x.usda@"))
    error = refused(ref)
    assert error.code == "outside_dataset" and "--allow-outside" in str(error)
    if "clips" not in text and "`" not in text and "variantSet" not in text:
        assert max(extract(ref, inputs=InputSettings(allow_outside=True)).features.rest_size) == pytest.approx(7.0)


def test_a_layer_elsewhere_in_the_dataset_is_inside_and_one_that_is_missing_is_said(tmp_path: Path) -> None:
    near = prim("Xform", "near", more="prepend references = @../shared/box.usda@")
    gone = prim("Xform", "gone", more="prepend references = @../shared/gone.usda@")
    ref = dataset(tmp_path, thing(near, gone))
    item = extract(ref)
    names = [file.name for file in asset_files(Path(ref.path), allowed_folders(ref, InputSettings()))]
    assert any("shared/box.usda" in name for name in names), "a change there is a change of the asset"
    assert item.features.rest_size == pytest.approx((0.3, 0.3, 0.3))
    assert "/Thing/gone: Could not open asset" in told(item) and "one rigid link" in told(item)


def test_names_in_a_package_lead_nowhere_else(tmp_path: Path) -> None:
    texture = prim(
        "Shader",
        "t",
        'uniform token info:id = "UsdUVTexture"',
        "asset inputs:file = @../../outside/x.png@",
        "float3 outputs:rgb",
    )
    surface = prim(
        "Shader",
        "s",
        'uniform token info:id = "UsdPreviewSurface"',
        "color3f inputs:diffuseColor.connect = </Thing/m/t.outputs:rgb>",
        "token outputs:surface",
    )
    material = prim("Material", "m", "token outputs:surface.connect = </Thing/m/s.outputs:surface>", texture, surface)
    bound = plate("mesh", (0.3, 0.3, 0.3), "rel material:binding = </Thing/m>")
    inner = thing(bound, material, prim("Xform", "x", more="prepend references = @../../outside/x.usda@"))
    own = SECRET.replace("3.5", "2.5")
    ref = dataset(tmp_path, b"", "thing.usdz")
    with zipfile.ZipFile(Path(ref.path) / "thing.usdz", "w") as package:
        for name, text in (("thing.usda", inner), ("../../outside/x.usda", own), ("../evil.usda", own)):
            package.writestr(name, text)
    before = sorted(tmp_path.rglob("*"))
    assert max(extract(ref).features.rest_size) == pytest.approx(5.0), "the package's own file of that name"
    assert sorted(tmp_path.rglob("*")) == before


def test_a_picture_outside_is_a_finding_and_not_read(tmp_path: Path) -> None:
    shader = prim(
        "Shader",
        "s",
        'uniform token info:id = "OmniPBR"',
        "asset inputs:diffuse_texture = @../../outside/x.png@",
        "token outputs:out",
    )
    material = prim("Material", "m", "token outputs:mdl:surface.connect = </Thing/m/s.outputs:out>", shader)
    bound = plate("mesh", (0.3, 0.3, 0.3), "rel material:binding = </Thing/m>")
    ref = dataset(tmp_path, thing(bound, material))
    opened = open_origin(Path(ref.path), reach=allowed_folders(ref, InputSettings()))
    assert "outside_dataset" in [finding.code for finding in opened.findings] or opened.refused
    assert str(tmp_path / "outside") not in opened.urdf.read_text()


@pytest.mark.system
def test_a_joint_that_closes_a_loop_is_named(tmp_path: Path) -> None:
    again = joint("Fixed", "again", ("/Thing/b", "/Thing/a"))
    spare = HINGE.replace('"hinge"', '"spare"').replace("{", "{\nbool physics:excludeFromArticulation = true", 1)
    still = joint("Fixed", "still", ("", "/Thing"))
    item = read(tmp_path, A, B, spare, HINGE, again, still)
    assert "/Thing/still is left out: both its sides stand still" in told(item)
    assert [j.name for j in item.features.joints] == ["hinge"]
    assert "the loop of 'hinge', '/Thing/spare' is stiff" in told(item)


def test_ten_million_declared_faces_are_refused_at_once(tmp_path: Path) -> None:
    from pxr import Usd, UsdGeom, Vt

    ref = dataset(tmp_path, "", "thing.usdc")
    file = Path(ref.path) / "thing.usdc"
    file.unlink()
    stage = Usd.Stage.CreateNew(str(file))
    mesh = UsdGeom.Mesh.Define(stage, "/Thing/mesh")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(10_000_000, 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.tile(np.arange(3, dtype=np.int32), 10_000_000)))
    stage.GetRootLayer().Save()
    error = refused(ref)
    assert error.code == "usd_mesh" and "/Thing/mesh has 10000000 triangles" in str(error)


def test_a_mirror_image_is_wound_outwards_and_a_sheet_is_read(tmp_path: Path) -> None:
    sheet = plate("sheet", (0.2, 0.2, 0.0), place=at((0.0, 0.0, 0.5)))
    scaled = prim("Xform", "flat", at((0.0, 0.0, 0.6), scale=(1, 1, 0)), plate("mesh", (0.2, 0.2, 0.1)))
    mirrored = prim("Xform", "mirrored", at((1.0, 0.0, 0.0), scale=(-1, 1, 1)), BOX)
    left = plate("left", (0.3, 0.3, 0.3), 'uniform token orientation = "leftHanded"')
    ref = dataset(tmp_path, thing(BOX, sheet, scaled, mirrored, left))
    opened = open_origin(Path(ref.path))
    meshes = {path.stem: trimesh.load_mesh(path) for path in opened.urdf.parent.glob("meshes/visual*")}
    volumes = {name: mesh.volume for name, mesh in meshes.items()}
    assert volumes["visual_Thing_mesh_0"] == pytest.approx(0.027), "the file's own winding"
    assert volumes["visual_Thing_left_0"] == pytest.approx(-0.027), "as it says"
    assert volumes["visual_Thing_mirrored_mesh_0"] == pytest.approx(0.027)
    assert extract(ref).features.rest_size == pytest.approx((1.3, 0.3, 0.75), abs=1e-6)


def test_without_usd_core_the_user_is_told_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pxr", None)
    error = refused(dataset(tmp_path, thing(BOX)))
    assert error.code == "usd_missing" and "asset2sim[usd]" in str(error)


def test_a_pipe_in_the_place_of_a_layer_is_refused(tmp_path: Path) -> None:
    ref = dataset(tmp_path, thing(more="prepend references = @./pipe.usda@"))
    os.mkfifo(Path(ref.path) / "pipe.usda")
    assert "is a pipe" in str(refused(ref))


def test_a_joint_that_follows_none_moves_freely(tmp_path: Path) -> None:
    follows = "rel newton:mimicJoint = </Thing/gone>"
    assert "/Thing/hinge follows /Thing/gone, which is not there" in told(
        read(tmp_path, A, B, HINGE.replace("float physics:lowerLimit", f"{follows}\nfloat physics:lowerLimit", 1))
    )
