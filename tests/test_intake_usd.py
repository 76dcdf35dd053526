"""USD as it comes from three kinds of tools and from ourselves: every number read, every part where USD has it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
import yourdfpy
from lxml import etree

from asset2sim.assets.exports.usd import export_usd
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.assets.urdf.read import passing_pairs, read_contacts, read_dynamics, read_urdf
from asset2sim.intake.formats.usd import urdf_of_usd
from asset2sim.intake.origin import extract
from asset2sim.physics.arrays import Array
from schemas.asset import AssetRef
from tests.assets import box_obj
from tests.builders import UrdfJoint, UrdfLink, box, mesh, sphere
from tests.exported import refined
from tests.origins import png
from tests.usd_stages import STAGES, Stage, at, body, joint, plate, prim, usda

pxr = pytest.importorskip("pxr", reason="usd-core is not installed")


class Truth:
    """Where USD itself has bodies and their points, by its own parser of joints and frames, in its own unit."""

    def __init__(self, file: Path) -> None:
        from pxr import Gf, Usd, UsdGeom, UsdPhysics

        self.stage = Usd.Stage.Open(str(file))
        cache = UsdGeom.XformCache()
        self.metre = UsdGeom.GetStageMetersPerUnit(self.stage)
        upright = Gf.Matrix3d(Gf.Rotation(Gf.Vec3d(1, 1, 1), 120.0))
        self.up = np.array(upright).T if UsdGeom.GetStageUpAxis(self.stage) == "Y" else np.eye(3)
        found = UsdPhysics.LoadUsdPhysicsFromRange(self.stage, ["/"])
        self.joints = {str(path): (str(kind), item) for kind, (paths, items) in found.items()
                       if "Joint" in str(kind) for path, item in zip(paths, items, strict=True)}  # fmt: skip
        self.rest, self.scale = dict[str, Array](), dict[str, float]()
        for path in map(str, found[UsdPhysics.ObjectType.RigidBody][0]):
            matrix = cache.GetLocalToWorldTransform(self.stage.GetPrimAtPath(path))
            self.rest[path] = np.array(matrix.RemoveScaleShear()).T
            self.scale[path] = float(np.linalg.norm(np.array(matrix)[0, :3]))
        self.points: dict[str, list[Array]] = {path: [] for path in self.rest}
        for item in Usd.PrimRange(self.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
            holders = [path for path in self.rest if str(item.GetPath()).startswith(f"{path}/")]
            if holders and item.IsA(UsdGeom.Mesh):
                body = max(holders, key=len)
                to_body = np.linalg.inv(self.rest[body]) @ np.array(cache.GetLocalToWorldTransform(item)).T
                points = np.array(UsdGeom.Mesh(item).GetPointsAttr().Get(), dtype=float)
                self.points[body].append(points @ to_body[:3, :3].T + to_body[:3, 3])

    def places(self, root: str, positions: Mapping[str, float]) -> dict[str, Array]:
        """Body → its (4, 4) place in USD's world, each joint of one axis at its position (rad or m)."""
        placed = {root: self.rest.get(root, np.eye(4))}
        left = dict(self.joints)
        while left:
            ready = (path for path, (_, item) in left.items() if {str(item.body0), str(item.body1)} & placed.keys())
            path = next(ready)
            kind, item = left.pop(path)
            first, second = str(item.body0), str(item.body1)
            step = self.step(path, kind, item, positions.get(path.rpartition("/")[2], 0.0))
            if first in placed:
                placed[second] = placed[first] @ step
            else:
                placed[first] = placed[second] @ np.linalg.inv(step)
        return placed

    def step(self, path: str, kind: str, item: Any, value: float) -> Array:
        """(4, 4) of a joint's second body in its first."""
        from pxr import Gf

        pairs = ((item.localPose0Position, item.localPose0Orientation),
                 (item.localPose1Position, item.localPose1Orientation))  # fmt: skip
        frames = [np.array(Gf.Matrix4d().SetRotate(Gf.Quatd(turn)).SetTranslateOnly(Gf.Vec3d(at))).T
                  for at, turn in pairs]  # fmt: skip
        motion = np.eye(4)
        axis = "Y" if path.endswith("/turn") else str(getattr(item, "axis", "X"))[-1]
        along = np.eye(3)["XYZ".index(axis)]
        if "Revolute" in kind or "D6" in kind:
            motion[:3, :3] = np.array(Gf.Matrix3d(Gf.Rotation(Gf.Vec3d(*along), math.degrees(value)))).T
        elif "Prismatic" in kind:
            motion[:3, 3] = along * value / self.metre
        return np.asarray(frames[0] @ motion @ np.linalg.inv(frames[1]))


@dataclass(frozen=True, eq=False)
class Case:
    """A stage, the URDF that was made of it, and the notes."""

    stage: Stage
    file: Path
    robot: Any
    notes: tuple[str, ...]

    @cached_property
    def truth(self) -> Truth:
        return Truth(self.file)

    @cached_property
    def urdf(self) -> yourdfpy.URDF:
        text = etree.tostring(self.robot).replace(b"<capsule", b"<cylinder")
        (self.file.parent / "made.urdf").write_bytes(text)
        return yourdfpy.URDF.load(str(self.file.parent / "made.urdf"), load_meshes=False, build_scene_graph=True)

    @cached_property
    def links(self) -> dict[str, str]:
        """Link → its body: named as its prim, and with its parent where that name is taken."""
        taken = {"/Thing/Geometry/cart/cart": "cart_cart"}
        return {taken.get(path, path.rpartition("/")[2]): path for path in self.truth.rest}

    def placed(self, positions: Mapping[str, float]) -> tuple[dict[str, Array], dict[str, Array]]:
        """Link → its body's place in USD, m, z up, and the link's in the same world by the URDF."""
        self.urdf.update_cfg(dict(positions))
        whole = dict(zip(self.urdf.actuated_joint_names, map(float, self.urdf.cfg), strict=True))
        for name, told in self.stage.joints.items():
            if "mimic" in told:
                leader = whole[str(told["mimic"])]
                whole[name] = float(told.get("multiplier", 1.0)) * leader + float(told.get("offset", 0.0))
        root = self.links.get(self.stage.root, "")
        theirs = dict[str, Array]()
        for link, place in ((link, self.truth.places(root, whole)[path]) for link, path in self.links.items()):
            theirs[link] = np.eye(4)
            theirs[link][:3, :3] = self.truth.up @ place[:3, :3]
            theirs[link][:3, 3] = self.truth.up @ place[:3, 3] * self.truth.metre
        start = np.eye(4)
        if root:
            start[:3, 3] = self.truth.up @ self.truth.rest[root][:3, 3] * self.truth.metre
        return theirs, {link: start @ self.urdf.get_transform(link) for link in self.links}


@pytest.fixture(params=STAGES)
def case(request: pytest.FixtureRequest, tmp_path: Path) -> Case:
    stage = STAGES[request.param]
    for name, text in stage.files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    file = tmp_path / next(iter(stage.files))
    made = urdf_of_usd(file, tmp_path)
    return Case(stage, file, made.robot, made.notes)


def exact(value: Any) -> Any:
    return pytest.approx(value, rel=1e-6, abs=1e-6)


def moved(pose: Array, points: Array) -> Array:
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def obj_points(file: str) -> Array:
    lines = Path(file).read_text().splitlines()
    return np.array([[float(word) for word in line.split()[1:]] for line in lines if line.startswith("v ")])


def test_every_part_stands_where_usd_has_it(case: Case) -> None:
    rng = np.random.default_rng(0)
    # Of joints of several axes only the place at zero is compared here.
    several = {name.rpartition("_")[0] for name in case.stage.joints if name.endswith("_1")}
    free = [name for name, told in case.stage.joints.items() if told["type"] != "fixed" and "mimic" not in told]
    for trial in range(5):
        still = {name for name in free if trial == 0 or name in several or name.rpartition("_")[0] in several}
        theirs, ours = case.placed({name: 0.0 if name in still else float(rng.uniform(-0.5, 0.5)) for name in free})
        for link, path in case.links.items():
            shown = [item.geometry.mesh for item in case.urdf.link_map[link].visuals if item.geometry.mesh]
            assert len(shown) >= len(case.truth.points[path])
            for points, item in zip(case.truth.points[path], shown, strict=False):
                expected = moved(theirs[link], points * case.truth.metre)
                assert moved(ours[link], obj_points(item.filename)) == exact(expected), link


def test_every_number_of_a_joint_is_read(case: Case) -> None:
    found: dict[str, dict[str, float | str]] = {}
    for element in case.robot.findall("joint"):
        told = found[element.get("name")] = {"type": element.get("type")}
        for tag in ("limit", "dynamics", "mimic"):
            for key, value in (pair for item in element.findall(tag) for pair in item.attrib.items()):
                told["mimic" if key == "joint" else key] = value if key == "joint" else float(value)
    assert set(found) == set(case.stage.joints)
    for name, expected in case.stage.joints.items():
        for key in {*expected, *(key for key, value in found[name].items() if value != 0.0)}:
            wanted = expected.get(key, 1.0 if key == "multiplier" else 0.0)
            expected_value = wanted if isinstance(wanted, str) else exact(wanted)
            assert found[name].get(key, 0.0) == expected_value, (name, key)
    assert case.notes == tuple(case.stage.notes)
    contacts = {name: (own.friction, own.restitution) for name, own in read_contacts(case.robot).items()}
    assert contacts == {name: exact(told) for name, told in case.stage.contacts.items()}


def test_masses_centres_and_inertias_are_read(case: Case) -> None:
    found = {link.name: link.inertial for link in case.urdf.robot.links if link.inertial is not None}
    assert {name: item.mass for name, item in found.items()} == exact(dict(case.stage.masses))
    theirs, ours = case.placed(dict.fromkeys(case.urdf.actuated_joint_names, 0.0))
    unit = case.truth.stage.GetMetadata("kilogramsPerUnit") * case.truth.metre**2
    for link, path in case.links.items():
        center, moments, turn = (
            case.truth.stage.GetPrimAtPath(path).GetAttribute(f"physics:{name}").Get()
            for name in ("centerOfMass", "diagonalInertia", "principalAxes")
        )
        if moments is None:  # of its shapes
            continue
        expected = moved(theirs[link], np.array([center]) * case.truth.scale[path] * case.truth.metre)[0]
        assert (ours[link] @ found[link].origin)[:3, 3] == exact(expected), link
        axes = np.eye(3) if not turn.GetLength() else np.array(pxr.Gf.Matrix3d(pxr.Gf.Quatd(turn))).T
        axes, own = theirs[link][:3, :3] @ axes, (ours[link] @ found[link].origin)[:3, :3]
        tensor = axes @ np.diag(np.array(moments, dtype=float) * unit) @ axes.T
        assert own @ found[link].inertia @ own.T == pytest.approx(tensor, abs=1e-6 * np.trace(tensor)), link


def test_what_we_export_is_read_back(tmp_path: Path) -> None:
    """A tree of every kind of joint, skew axes and tensors, meshes and primitives, in a state that is not zero."""
    (tmp_path / "wedge.obj").write_text(box_obj((0.0, -0.02, 0.0), (0.2, 0.02, 0.05)))
    skew = (0.0123456789, 1.1e-3, -2.2e-3, 0.0223456789, 3.3e-4, 0.0253456789)
    shapes = ((mesh("wedge.obj"), (0.01, 0.02, 0.03)), (box(0.1, 0.2, 0.3), (0, 0, 0.1)), (sphere(0.04), (0.1, 0, 0)))
    links = [UrdfLink("base", 4.0, (0.01, 0.0, -0.02), skew, shapes)]
    kinds, axes = ("revolute", "prismatic", "continuous", "fixed"), ((0.6, -0.8, 0.0), (0, 0, -1), (-0.8, 0.36, 0.48))
    joints = []
    for index, kind in enumerate((*kinds, *kinds[:2])):
        links.append(UrdfLink(f"part {index}", 0.1 + index, (0.1, 0.2, 0.3), skew, shapes[: index % 3]))
        joints.append(UrdfJoint(f"joint {index}", kind, links[index // 2].name, links[-1].name, axes[index % 3],
                                (0.1 * index, 0.3, -0.2), -0.7, 1.1 + index, 0.02 + index, 0.3, 0.9 + index, 0.25,
                                0.004))  # fmt: skip
    overlay = refined(tmp_path, links, joints, {f"joint {index}": 0.1 * index for index in range(6)})
    made = urdf_of_usd(export_usd(tmp_path, overlay).path, tmp_path)
    back = tmp_path / "back.urdf"
    back.write_bytes(etree.tostring(made.robot))
    was, now = read_urdf(tmp_path / URDF_NAME), read_urdf(back)
    links_now, joints_now = ({item.name: item for item in items} for items in (now.links, now.joints))
    assert set(links_now) == {link.name for link in was.links} and len(joints_now) == len(was.joints)
    for old in was.links:
        new = links_now[old.name]
        assert new.inertial.mass == exact(old.inertial.mass)
        assert new.inertial.origin[:3, 3] == exact(old.inertial.origin[:3, 3])
        turn = new.inertial.origin[:3, :3]
        assert turn @ new.inertial.inertia @ turn.T == pytest.approx(old.inertial.inertia, rel=1e-6, abs=1e-8)
        for one, other in zip(old.collisions, new.collisions, strict=True):
            if one.geometry.mesh is None:
                assert other.origin == exact(one.origin)
                for name, sizes in vars(one.geometry.box or one.geometry.sphere).items():
                    found = getattr(other.geometry.box or other.geometry.sphere, name)
                    assert found == exact(sizes)
            else:
                points = moved(one.origin, obj_points(str(tmp_path / one.geometry.mesh.filename)))
                apart = np.linalg.norm(points[:, None] - obj_points(other.geometry.mesh.filename), axis=2)
                assert apart.min(axis=0).max() < 1e-6 and apart.min(axis=1).max() < 1e-6
    terms, found_terms = read_dynamics(tmp_path / URDF_NAME), read_dynamics(back)
    for old in was.joints:
        new = joints_now[old.name]
        assert (new.type, new.parent, new.child) == (old.type, old.parent, old.child)
        assert new.origin == exact(old.origin)
        if old.type != "fixed":
            assert new.axis == exact(old.axis)
            found, stated = (dict(vars(items[old.name])) for items in (found_terms, terms))
            assert found.pop("bias") == exact(stated.pop("bias")) and found == exact(stated)
            if old.type != "continuous":
                assert (new.limit.lower, new.limit.upper) == exact((old.limit.lower, old.limit.upper))


TEXTURED = """def Mesh "mesh" (prepend apiSchemas = ["MaterialBindingAPI"]) {
  point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0), (2,0,0), (2,1,0), (3,0,0), (3,1,0), (4,0.5,0)]
  int[] faceVertexCounts = [4, 4, 5]
  int[] faceVertexIndices = [0,1,2,3, 1,4,5,2, 4,6,8,7,5]
  int[] holeIndices = [HOLES]
  texCoord2f[] primvars:st = [(0,0),(1,0),(1,1),(0,1),(0,0),(0,0),(0,0),(0,0),(0,0)] ( interpolation = "vertex" )
  color3f[] primvars:displayColor = [(0, 0, 1)]
  def GeomSubset "part" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    uniform token elementType = "face"
    uniform token familyName = "materialBind"
    int[] indices = [0]
    rel material:binding = </Thing/paint>
  }
}
def Material "paint" {
  token outputs:surface.connect = </Thing/paint/s.outputs:surface>
  def Shader "s" {
    uniform token info:id = "UsdPreviewSurface"
    color3f inputs:diffuseColor.connect = </Thing/paint/t.outputs:rgb>
    float inputs:opacity = 0.5
    token outputs:surface
  }
  def Shader "t" {
    uniform token info:id = "UsdUVTexture"
    asset inputs:file = @./wood.png@
    float4 inputs:scale = (1, 0.5, 1, 1)
    float3 outputs:rgb
  }
}"""


@pytest.mark.parametrize("suffix", [".usda", ".usdz"])
def test_subsets_textures_colours_polygons_and_holes(tmp_path: Path, suffix: str) -> None:
    from pxr import UsdUtils

    file = tmp_path / "thing.usda"
    file.write_text(usda(prim("Xform", "Thing", TEXTURED.replace("HOLES", "1"))))
    (tmp_path / "wood.png").write_bytes(png(150, 100, 50))
    if suffix == ".usdz":
        assert UsdUtils.CreateNewUsdzPackage(str(file), str(file.with_suffix(suffix)))
        (tmp_path / "wood.png").unlink()
    robot: Any = urdf_of_usd(file.with_suffix(suffix), tmp_path).robot
    painted, plain = robot.findall("link/visual")
    assert [float(v) for v in painted.find("material/color").get("rgba").split()] == exact([1, 0.5, 1, 0.5])
    assert Path(painted.find("material/texture").get("filename")).read_bytes() == png(150, 100, 50)
    assert plain.find("material/texture") is None and plain.find("material/color").get("rgba") == "0 0 1 1"
    meshes = [trimesh.load_mesh(item.find("geometry/mesh").get("filename")) for item in (painted, plain)]
    assert [mesh.area for mesh in meshes] == exact([1.0, 1.5]) and len(meshes[1].faces) == 3
    assert "vt 1.0 1.0" in Path(painted.find("geometry/mesh").get("filename")).read_text()


def link_of(folder: Path, *inside: str) -> Any:
    """The one link of a stage."""
    (folder / "thing.usda").write_text(usda(prim("Xform", "Thing", *inside)))
    return urdf_of_usd(folder / "thing.usda", folder).robot.find("link")


SHAPES = {
    "box": ('def Cube "a" { double size = 2 PLACE }', (1, 2, 3), {"size": "2 4 6"}),
    "sphere": ('def Sphere "a" { double radius = 0.5 PLACE }', (2, 2, 2), {"radius": "1"}),
    "cylinder": ('def Cylinder "a" { double radius = 1\ndouble height = 3\nuniform token axis = "X" PLACE }', (2, 3, 3),
                 {"radius": "3", "length": "6"}),
    "capsule": ('def Capsule "a" { double radius = 1\ndouble height = 3\nuniform token axis = "Y" PLACE }', (2, 2, 2),
                {"radius": "2", "length": "6"}),
}  # fmt: skip


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("skewed", [False, True])
def test_a_primitive_stays_one_where_its_scale_allows(tmp_path: Path, kind: str, skewed: bool) -> None:
    """Else it is a mesh of the same extent."""
    text, scale, size = SHAPES[kind]
    inner = at((0, 0, 0), (math.sqrt(0.9), 0.1, 0.3, 0.0), scale)
    text = text.replace("PLACE", f"\n{inner}\n").replace(" {", ' (prepend apiSchemas = ["PhysicsCollisionAPI"]) {')
    outer = at((1, 2, 3), scale=(1, 1, 1.5) if skewed else (2, 2, 2))
    shape = link_of(tmp_path, outer, text).find("collision/geometry")[0]
    assert shape.tag == ("mesh" if skewed else kind)
    if not skewed:
        assert [float(v) for v in dict(shape.attrib).popitem()[1].split()] == exact(
            [2 * float(v) for v in list(size.values())[-1].split()])  # fmt: skip
        return
    stage = pxr.Usd.Stage.Open(str(tmp_path / "thing.usda"))
    low, high = obj_points(shape.get("filename")).min(axis=0), obj_points(shape.get("filename")).max(axis=0)
    boxed = (
        pxr.UsdGeom.BBoxCache(0.0, ["default"]).ComputeWorldBound(stage.GetPrimAtPath("/Thing")).ComputeAlignedRange()
    )
    assert np.all(low >= np.array(boxed.GetMin()) - 1e-6) and np.all(high <= np.array(boxed.GetMax()) + 1e-6)


@pytest.mark.parametrize(
    ("line", "roles"),
    [
        ("", ["visual", "collision"]),
        ('uniform token purpose = "guide"', ["collision"]),
        ('uniform token purpose = "proxy"', ["collision"]),
        ('uniform token purpose = "render"', ["visual", "collision"]),
        ('token visibility = "invisible"', ["collision"]),
        ("bool physics:collisionEnabled = false", ["visual"]),
    ],
)
def test_what_is_drawn_and_what_collides(tmp_path: Path, line: str, roles: list[str]) -> None:
    assert [item.tag for item in link_of(tmp_path, plate("mesh", (1, 1, 1), line))] == roles


@pytest.mark.parametrize(("how", "tag"), [("boundingCube", "box"), ("boundingSphere", "sphere"), ("none", "mesh")])
def test_a_mesh_collides_as_it_says(tmp_path: Path, how: str, tag: str) -> None:
    text = plate("mesh", (1, 2, 3)).replace('"convexHull"', f'"{how}"')
    shape = link_of(tmp_path, text).find("collision/geometry")[0]
    assert shape.tag == tag and shape.get("size", "1 2 3") == "1 2 3"
    assert float(shape.get("radius", math.sqrt(3.5))) == exact(math.sqrt(3.5))


MASSES = {
    "mass": ("float physics:mass = 6", "", 6.0),
    "density": ("float physics:density = 500", "", 3000.0),
    "shape": ("", "float physics:mass = 12", 12.0),
    "shape's density": ("float physics:density = 500", "float physics:density = 2", 12.0),
}


@pytest.mark.parametrize("how", MASSES)
def test_a_mass_without_an_inertia_has_that_of_its_shapes(tmp_path: Path, how: str) -> None:
    of_body, of_shape, mass = MASSES[how]
    shape = plate("mesh", (1, 2, 3), of_shape, place=at((0.5, 0.0, 0.0)))
    part = prim("Xform", "part", of_body, shape, apis=("PhysicsRigidBodyAPI", "PhysicsMassAPI"))
    inertial = link_of(tmp_path, part).find("inertial")
    assert float(inertial.find("mass").get("value")) == exact(mass)
    assert [float(v) for v in inertial.find("origin").get("xyz").split()] == exact([0.5, 0.0, 0.0])
    moments = [float(inertial.find("inertia").get(key)) for key in ("ixx", "iyy", "izz", "ixy")]
    assert moments == exact([mass * 13 / 12, mass * 10 / 12, mass * 5 / 12, 0.0])


def test_the_ground_and_what_repeats_points_are_no_part_of_it(tmp_path: Path) -> None:
    """The file has no unit either: its lengths are USD's centimetres, and no metres that must stay."""
    ground = prim("Xform", "ground", prim("Plane", "endless"), plate("sheet", (100, 100, 0)))
    many = prim("PointInstancer", "many", plate("seed", (1, 1, 1)))
    foot = joint("Fixed", "foot", ("", "/Thing/part"))
    text = usda(
        prim("Xform", "Thing", body("part", plate("mesh", (30, 30, 30)), mass=1.0), foot, ground, many), metres=None
    )
    (tmp_path / "thing.usda").write_text(text)
    item = extract(AssetRef(asset_id="one", path=str(tmp_path)))
    assert item.features.rest_size == exact((0.3, 0.3, 0.3)) and item.features.root == "part"
    told = next(finding.message for finding in item.findings if finding.code == "converted_usd")
    assert (
        all(word in told for word in ("/Thing/ground/endless", "/Thing/many", "metersPerUnit")) and "/seed" not in told
    )
    assert urdf_of_usd(tmp_path / "thing.usda", tmp_path).metric is False


def test_pairs_that_pass_and_what_a_mechanism_exerts_are_read_back(tmp_path: Path) -> None:
    base, clicks = UrdfLink("base", 1.0), (-5.0, 0.1, -0.2, 0.2, 0.5)
    parts = [UrdfLink(name, 1.0) for name in ("one", "two")]
    joints = [
        UrdfJoint("j", "revolute", "base", "one", lower=-1.0, upper=1.0, bias=clicks),
        UrdfJoint("k", "prismatic", "base", "two", lower=0.0, upper=1.0),
    ]
    overlay = refined(tmp_path, [base, *parts], joints)
    urdf = tmp_path / URDF_NAME
    text = urdf.read_text().replace("</robot>", '<disable_collisions link1="one" link2="two"/></robot>')
    urdf.write_text(text)
    back = tmp_path / "back.urdf"
    back.write_bytes(etree.tostring(urdf_of_usd(export_usd(tmp_path, overlay).path, tmp_path).robot))
    assert read_dynamics(back)["j"].bias == exact(clicks) and read_dynamics(back)["k"].bias[0] == 0.0
    assert [set(pair) for pair in passing_pairs(parsed_root(back))] == [{"one", "two"}]
