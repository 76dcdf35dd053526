import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lxml import etree
from scipy.spatial.transform import Rotation

from asset2sim.assets.exports import require_exports
from asset2sim.assets.exports.mjcf import export_mjcf
from asset2sim.assets.exports.refined_object import MJCF_NAME, USD_NAME
from asset2sim.assets.exports.usd import GEOMETRY_NAME, export_usd
from asset2sim.assets.exports.usd_joints import VARIANTS, rotation_from_x
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.read import read_dynamics, read_urdf
from asset2sim.intake.formats.usd import urdf_of_usd
from schemas.errors import UsageError
from schemas.vocabulary import Export
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, box, mesh, sphere
from tests.consumers import python_with
from tests.exported import ARM_INERTIA, BASE, FRICTION, arm, refined

pxr = pytest.importorskip("pxr", reason="usd-core is not installed")

DEGREE = math.pi / 180.0
TENSOR = (0.0123456789012, 1.1e-3, -2.2e-3, 0.0223456789012, 3.3e-4, 0.0253456789012)


def opened(folder: Path) -> Any:
    from pxr import Usd

    return Usd.Stage.Open(str(folder / USD_NAME))


def prim(stage: Any, name: str) -> Any:
    """The prim of a link or a joint, by its URDF name."""
    return next(item for item in stage.Traverse() if item.GetDisplayName() == name)


def value(item: Any, name: str) -> Any:
    attribute = item.GetAttribute(name)
    assert attribute.IsAuthored(), name
    return attribute.Get()


def to_world(item: Any) -> Any:
    """(4, 4) transform of columns, as everywhere else of ours; USD's matrices act on rows."""
    from pxr import UsdGeom

    return np.array(UsdGeom.XformCache().GetLocalToWorldTransform(item)).T


def test_a_hinges_terms_are_per_degree(tmp_path: Path) -> None:
    overlay = arm(tmp_path, 0.7, lower=-0.5, upper=1.5, damping=0.02, friction=0.3, stiffness=0.9, reference=0.25)
    export_usd(tmp_path, overlay)
    stage = opened(tmp_path)
    joint = prim(stage, "j")
    assert joint.GetTypeName() == "PhysicsRevoluteJoint"
    assert value(joint, "physics:lowerLimit") == pytest.approx(-0.5 / DEGREE)
    assert value(joint, "physics:upperLimit") == pytest.approx(1.5 / DEGREE)
    assert value(joint, "drive:angular:physics:stiffness") == pytest.approx(0.9 * DEGREE)
    assert value(joint, "drive:angular:physics:damping") == pytest.approx(0.02 * DEGREE)
    assert value(joint, "drive:angular:physics:targetPosition") == pytest.approx(0.25 / DEGREE)
    assert value(joint, "drive:angular:physics:type") == "force"
    assert value(joint, "state:angular:physics:position") == pytest.approx(0.7 / DEGREE)
    assert value(joint, "physxJointAxis:angular:staticFrictionEffort") == pytest.approx(0.3)
    assert value(joint, "physxJointAxis:angular:dynamicFrictionEffort") == pytest.approx(0.3)
    assert value(joint, "newton:friction") == pytest.approx(0.3)
    assert value(joint, "physxJoint:jointFriction") == 0.0
    assert not joint.HasAttribute("physxJoint:armature")
    assert not joint.GetAttribute("newton:damping").IsAuthored()
    assert {"PhysicsDriveAPI:angular", "PhysicsJointStateAPI:angular", "PhysxJointAxisAPI:angular"} <= {
        *joint.GetPrimTypeInfo().GetAppliedAPISchemas()
    }


def test_the_variant_for_mujoco_has_passive_terms_where_the_other_has_a_drive(tmp_path: Path) -> None:
    seal = (50.0, 0.03, -1.0, 0.0)
    export_usd(tmp_path, arm(tmp_path, 0.7, lower=-0.5, upper=1.5, damping=0.02, friction=0.3, stiffness=0.9,
                             reference=0.25, armature=0.03, bias=seal))  # fmt: skip
    stage = opened(tmp_path)
    variants = stage.GetDefaultPrim().GetVariantSet(VARIANTS)
    assert variants.GetVariantSelection() == "physx" and sorted(variants.GetVariantNames()) == ["mujoco", "physx"]
    joint = prim(stage, "j")
    assert not [name for name in joint.GetPropertyNames() if name.startswith("mjc:")]
    assert not any(item.GetTypeName() == "MjcActuator" for item in stage.Traverse())
    variants.SetVariantSelection("mujoco")
    joint = prim(stage, "j")
    assert not [name for name in joint.GetPropertyNames() if name.startswith(("drive:", "state:"))]
    stated = {"ref": 0.7 / DEGREE, "springref": 0.25 / DEGREE, "stiffness": 0.9, "damping": 0.02, "frictionloss": 0.3,
              "armature": 0.03, "actuatorfrcrange:min": -101.0, "actuatorfrcrange:max": 100.0}  # fmt: skip
    assert {name: value(joint, f"mjc:{name}") for name in stated} == pytest.approx(stated)
    assert value(joint, "newton:armature") == pytest.approx(0.03)
    assert value(joint, "newton:damping") == pytest.approx(0.02 * DEGREE)
    assert value(joint, "physics:upperLimit") == pytest.approx(1.5 / DEGREE)
    assert value(joint, "mjc:solimplimit")[0] == 0.9999 and value(joint, "mjc:solreflimit")[0] == 3.0 / 240.0
    (actuator,) = (item for item in stage.Traverse() if item.GetTypeName() == "MjcActuator")
    assert actuator.GetRelationship("mjc:target").GetTargets() == [joint.GetPath()]
    assert list(value(actuator, "mjc:biasPrm"))[:3] == [-1.5, 50.0, 0.0]
    assert (value(actuator, "mjc:forceRange:min"), value(actuator, "mjc:forceRange:max")) == (-1.0, 0.0)
    collision = stage.GetPrimAtPath(prim(stage, "base").GetPath().AppendChild("collision_0"))
    assert (value(collision, "mjc:condim"), value(collision, "mjc:priority")) == (3, 1)
    contact = stage.GetPrimAtPath(stage.GetDefaultPrim().GetPath().AppendChild("contact"))
    assert value(contact, "newton:torsionalFriction") == pytest.approx(value(contact, "mjc:torsionalfriction"))


def test_our_reader_takes_the_variant_for_mujoco_as_mujoco_does(tmp_path: Path) -> None:
    """Zero is where the bodies stand, and no term counts twice."""
    path = export_usd(tmp_path, arm(tmp_path, 0.7, lower=-0.5, upper=1.5, damping=0.02, friction=0.3, stiffness=0.9,
                                    reference=0.25, armature=0.03)).path  # fmt: skip
    stage = opened(tmp_path)
    stage.GetDefaultPrim().GetVariantSet(VARIANTS).SetVariantSelection("mujoco")
    stage.Save()
    back = tmp_path / "back.urdf"
    back.write_bytes(etree.tostring(urdf_of_usd(path, tmp_path).robot))
    (joint,) = read_urdf(back).joints
    assert (joint.limit.lower, joint.limit.upper) == pytest.approx((-1.2, 0.8), abs=1e-6)
    assert Rotation.from_matrix(joint.origin[:3, :3]).as_rotvec() == pytest.approx([0.0, 0.0, 0.7], abs=1e-6)
    terms = read_dynamics(back)["j"]
    assert (terms.damping, terms.friction, terms.stiffness, terms.armature) == pytest.approx((0.02, 0.3, 0.9, 0.03))
    assert terms.spring_reference == pytest.approx(0.25 - 0.7)


def test_armature_is_that_of_the_urdf_in_kilograms_and_metres(tmp_path: Path) -> None:
    export_usd(tmp_path, arm(tmp_path, armature=0.03))
    assert value(prim(opened(tmp_path), "j"), "physxJoint:armature") == pytest.approx(0.03)


def test_a_sliders_terms_are_per_metre(tmp_path: Path) -> None:
    slide = UrdfJoint("slide", "prismatic", "base", "drawer", axis=(0, 1, 0), lower=0.0, upper=0.4, damping=3.0,
                      friction=1.5, stiffness=20.0, reference=0.1)  # fmt: skip
    export_usd(tmp_path, refined(tmp_path, [BASE, UrdfLink("drawer")], [slide], {"slide": 0.2}))
    stage = opened(tmp_path)
    joint = prim(stage, "slide")
    assert joint.GetTypeName() == "PhysicsPrismaticJoint"
    assert value(joint, "physics:upperLimit") == pytest.approx(0.4)
    assert value(joint, "drive:linear:physics:stiffness") == pytest.approx(20.0)
    assert value(joint, "drive:linear:physics:damping") == pytest.approx(3.0)
    assert value(joint, "drive:linear:physics:targetPosition") == pytest.approx(0.1)
    assert value(joint, "state:linear:physics:position") == pytest.approx(0.2)
    assert value(joint, "physxJointAxis:linear:staticFrictionEffort") == pytest.approx(1.5)


def test_principal_axes_and_moments_give_the_tensor_back(tmp_path: Path) -> None:
    part = UrdfLink("part", mass=1.25, com=(0.1, -0.2, 0.3), inertia=TENSOR)
    export_usd(tmp_path, refined(tmp_path, [BASE, part], [UrdfJoint("j", "revolute", "base", "part")]))
    stage = opened(tmp_path)
    body = prim(stage, "part")
    assert value(body, "physics:mass") == 1.25
    assert list(value(body, "physics:centerOfMass")) == pytest.approx([0.1, -0.2, 0.3])
    quat = value(body, "physics:principalAxes")
    turn = Rotation.from_quat([*quat.GetImaginary(), quat.GetReal()]).as_matrix()
    found = turn @ np.diag(np.array(value(body, "physics:diagonalInertia"), dtype=float)) @ turn.T
    xx, xy, xz, yy, yz, zz = TENSOR
    assert found == pytest.approx(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), rel=1e-5, abs=1e-7)


def test_the_links_stand_in_the_initial_state_where_the_joints_put_them(tmp_path: Path) -> None:
    lid = UrdfLink("lid", shapes=((box(0.2, 0.1, 0.02), (0.1, 0.0, 0.0)),))
    knob = UrdfLink("knob")
    joints = [
        UrdfJoint("hinge", "revolute", "base", "lid", axis=(0.6, 0.0, 0.8), xyz=(0.1, 0.0, 0.2)),
        UrdfJoint("turn", "continuous", "lid", "knob", axis=(-1.0, 0.0, 0.0), xyz=(0.0, 0.3, 0.0)),
        UrdfJoint("glue", "fixed", "knob", "tip", xyz=(0.0, 0.0, 0.5)),
    ]
    links = [BASE, lid, knob, UrdfLink("tip")]
    export_usd(tmp_path, refined(tmp_path, links, joints, {"hinge": 0.8, "turn": 4.0}))
    stage = opened(tmp_path)
    for name, position in (("hinge", 0.8), ("turn", 4.0), ("glue", 0.0)):
        joint = prim(stage, name)
        frames = []
        for side in (0, 1):
            target = joint.GetRelationship(f"physics:body{side}").GetTargets()[0]
            frame = np.eye(4)
            quat = value(joint, f"physics:localRot{side}")
            frame[:3, :3] = Rotation.from_quat([*quat.GetImaginary(), quat.GetReal()]).as_matrix()
            frame[:3, 3] = value(joint, f"physics:localPos{side}")
            frames.append(to_world(stage.GetPrimAtPath(target)) @ frame)
        # The second frame is the first, turned about its own x by the joint's position.
        apart = np.linalg.inv(frames[0]) @ frames[1]
        wanted = np.eye(4)
        wanted[:3, :3] = Rotation.from_euler("x", position).as_matrix()
        assert apart == pytest.approx(wanted, abs=1e-6), name
    assert not prim(stage, "turn").GetAttribute("physics:upperLimit").IsAuthored()
    assert prim(stage, "glue").GetTypeName() == "PhysicsFixedJoint"
    # The base is 0.1 m high about its origin, and the lid is above it.
    assert to_world(prim(stage, "base"))[2, 3] == pytest.approx(0.05, abs=1e-9)


def test_what_collides_is_convex_has_the_friction_and_is_where_it_was(tmp_path: Path) -> None:
    from pxr import UsdGeom, UsdPhysics, UsdShade

    corners = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (tmp_path / "hull.obj").write_text(corners)
    shapes = ((mesh("hull.obj"), (0.0, 0.0, 0.2)), (box(0.2, 0.4, 0.6), (0.5, 0.0, 0.0)), (sphere(0.3), ORIGIN))
    export_usd(tmp_path, refined(tmp_path, [UrdfLink("body", shapes=shapes)], []))
    stage = opened(tmp_path)
    hull, cube, ball = [item for item in stage.Traverse() if item.HasAPI(UsdPhysics.CollisionAPI)]
    assert UsdPhysics.MeshCollisionAPI(hull).GetApproximationAttr().Get() == "convexHull"
    assert np.array(UsdGeom.Mesh(hull).GetPointsAttr().Get()).max() == pytest.approx(0.1)
    boxes = UsdGeom.BBoxCache(0, [UsdGeom.Tokens.guide])
    body = stage.GetPrimAtPath(hull.GetPath().GetParentPath())
    bounds = [boxes.ComputeRelativeBound(item, body).ComputeAlignedRange() for item in (hull, cube, ball)]
    assert [list(item.GetMin()) for item in bounds] == [
        pytest.approx([0, 0, 0.2]), pytest.approx([0.4, -0.2, -0.3]), pytest.approx([-0.3, -0.3, -0.3])
    ]  # fmt: skip
    assert [list(item.GetMax()) for item in bounds] == [
        pytest.approx([0.1, 0.1, 0.3]), pytest.approx([0.6, 0.2, 0.3]), pytest.approx([0.3, 0.3, 0.3])
    ]  # fmt: skip
    for item in (hull, cube, ball):
        material, _ = UsdShade.MaterialBindingAPI(item).ComputeBoundMaterial("physics")
        friction = UsdPhysics.MaterialAPI(material.GetPrim())
        assert friction.GetStaticFrictionAttr().Get() == pytest.approx(FRICTION)
        assert friction.GetDynamicFrictionAttr().Get() == pytest.approx(FRICTION)


def test_visuals_are_there_with_their_texture_and_do_not_collide(tmp_path: Path) -> None:
    from PIL import Image
    from pxr import UsdGeom, UsdPhysics, UsdShade

    Image.new("RGB", (4, 4), (200, 10, 10)).save(tmp_path / "red.png")
    (tmp_path / "look.mtl").write_text("newmtl m\nKd 1 1 1\nmap_Kd red.png\n")
    flat = "mtllib look.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl m\nf 1/1 2/2 3/3\n"
    (tmp_path / "look.obj").write_text(flat)
    overlay = refined(tmp_path, [BASE], [])
    urdf = tmp_path / "mobility.urdf"
    visual = '<visual><geometry><mesh filename="look.obj" scale="0.5 0.5 0.5"/></geometry></visual>'
    urdf.write_text(urdf.read_text().replace("</link>", visual + "</link>"))
    export_usd(tmp_path, overlay)
    stage = opened(tmp_path)
    look = next(item for item in stage.Traverse() if item.IsA(UsdGeom.Mesh))
    assert not look.HasAPI(UsdPhysics.CollisionAPI)
    assert np.array(UsdGeom.Mesh(look).GetPointsAttr().Get()).max() == pytest.approx(0.5)
    material, _ = UsdShade.MaterialBindingAPI(look).ComputeBoundMaterial()
    files = [
        UsdShade.Shader(item).GetInput("file").Get()
        for item in stage.Traverse()
        if item.IsA(UsdShade.Shader) and UsdShade.Shader(item).GetInput("file")
    ]
    assert [Path(file.resolvedPath) for file in files] == [(tmp_path / "red.png").resolve()]
    assert material


def test_the_whole_is_one_articulation_in_metres_with_z_up(tmp_path: Path) -> None:
    from pxr import UsdGeom, UsdPhysics

    export_usd(tmp_path, arm(tmp_path))
    stage = opened(tmp_path)
    (root,) = (item for item in stage.Traverse() if item.HasAPI(UsdPhysics.ArticulationRootAPI))
    assert root == prim(stage, "base")
    assert value(root, "physxArticulation:enabledSelfCollisions") is True
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdPhysics.GetStageKilogramsPerUnit(stage) == 1.0
    bodies = [item.GetDisplayName() for item in stage.Traverse() if item.HasAPI(UsdPhysics.RigidBodyAPI)]
    assert bodies == ["base", "arm"]
    assert [value(prim(stage, name), "physxRigidBody:angularDamping") for name in bodies] == [0.0, 0.0]


def test_usds_own_parser_of_physics_finds_nothing_wrong(tmp_path: Path) -> None:
    from pxr import UsdPhysics

    export_usd(tmp_path, arm(tmp_path, lower=-0.5, upper=1.5, damping=0.02))
    stage = opened(tmp_path)
    found = UsdPhysics.LoadUsdPhysicsFromRange(stage, ["/"])
    kinds = {kind for kind, (_, items) in found.items() if items}
    assert {
        UsdPhysics.ObjectType.RigidBody, UsdPhysics.ObjectType.RevoluteJoint, UsdPhysics.ObjectType.Articulation
    } <= kinds  # fmt: skip
    paths, joints = found[UsdPhysics.ObjectType.RevoluteJoint]
    assert len(paths) == 1 and joints[0].isValid and joints[0].limit.enabled and joints[0].drive.enabled
    assert joints[0].limit.lower == pytest.approx(-0.5 / DEGREE)


def test_the_articulations_root_is_the_urdfs_whatever_hangs_on_it(tmp_path: Path) -> None:
    from pxr import UsdPhysics

    # Left to itself, the parser chooses the link in the middle of the tree.
    links = [BASE, *(UrdfLink(f"link_{i}") for i in range(4))]
    parents = ("base", "link_0", "link_0", "link_1")
    joints = [UrdfJoint(f"j{i}", "revolute", parent, f"link_{i}") for i, parent in enumerate(parents)]
    export_usd(tmp_path, refined(tmp_path, links, joints))
    stage = opened(tmp_path)
    found = UsdPhysics.LoadUsdPhysicsFromRange(stage, ["/"])
    _, (articulation,) = found[UsdPhysics.ObjectType.Articulation]
    assert articulation.rootPrims == [prim(stage, "base").GetPath()]
    assert len(articulation.articulatedBodies) == 5 and len(articulation.articulatedJoints) == 4


def test_a_drive_may_use_the_urdfs_effort_and_no_more(tmp_path: Path) -> None:
    overlay = arm(tmp_path, lower=-0.5, upper=1.5, damping=0.02, stiffness=0.9)
    export_usd(tmp_path, overlay)
    effort = read_urdf(tmp_path / URDF_NAME).joints[0].limit.effort
    assert value(prim(opened(tmp_path), "j"), "drive:angular:physics:maxForce") == effort > 0.0


def test_names_that_usd_does_not_take_stay_apart(tmp_path: Path) -> None:
    links = [UrdfLink("a b"), UrdfLink("a-b"), UrdfLink("1"), UrdfLink("joints")]
    joints = [UrdfJoint(f"x{i}", "revolute", "a b", link.name) for i, link in enumerate(links[1:])]
    export_usd(tmp_path, refined(tmp_path, links, joints))
    stage = opened(tmp_path)
    assert len({prim(stage, link.name).GetPath() for link in links}) == 4


def test_it_opens_from_its_folder_alone(tmp_path: Path) -> None:
    folder = tmp_path / "there"
    folder.mkdir()
    export_usd(folder, arm(folder))
    moved = folder.rename(tmp_path / "else where")
    assert (moved / GEOMETRY_NAME).is_file() and str(tmp_path) not in (moved / USD_NAME).read_text()
    stage = opened(moved)
    assert prim(stage, "base").GetChildren()


@pytest.mark.parametrize("axis", [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, -1), (0.6, -0.8, 0.0), (-0.8, 0.36, 0.48)])
def test_x_is_turned_to_any_axis(axis: tuple[float, float, float]) -> None:
    turn = rotation_from_x(np.array(axis, dtype=float))
    assert turn[:, 0] == pytest.approx(np.array(axis, dtype=float))
    assert turn @ turn.T == pytest.approx(np.eye(3)) and np.linalg.det(turn) == pytest.approx(1.0)


def test_without_usd_core_the_user_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("asset2sim.assets.exports.find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r"usd-core.*asset2sim\[usd\]"):
        require_exports((Export.USD,))


NEWTON = """
import sys, numpy as np, newton, warp as wp
from pxr import Usd
wp.config.quiet = True
from newton.usd import SchemaResolverMjc, SchemaResolverNewton, SchemaResolverPhysx
stage = Usd.Stage.Open(sys.argv[1])
stage.GetDefaultPrim().GetVariantSet("Physics").SetVariantSelection(sys.argv[2])
builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
builder.add_usd(stage, schema_resolvers=[SchemaResolverNewton(), SchemaResolverMjc(), SchemaResolverPhysx()])
model = builder.finalize(device="cpu")
solver = newton.solvers.SolverMuJoCo(model, use_mujoco_cpu=True)
"""
NEWTON_RUN = """
now, then, control = model.state(), model.state(), model.control()
qd = now.joint_qd.numpy(); qd[-1] = float(sys.argv[3]); now.joint_qd.assign(qd)
force = np.zeros_like(qd); force[-1] = float(sys.argv[4]); control.joint_f.assign(force)
start = float(now.joint_q.numpy()[-1])
for _ in range(int(float(sys.argv[5]) / 1e-3)):
    now.clear_forces()
    solver.step(now, then, control, None, 1e-3)
    now, then = then, now
print(start, float(now.joint_q.numpy()[-1]), float(now.joint_qd.numpy()[-1]))
"""
NEWTON_TERMS = """
mj = solver.mj_model
j, d, q = mj.njnt - 1, mj.nv - 1, mj.nq - 1
zero = mj.qpos0[q]
print(mj.dof_damping[d], mj.dof_frictionloss[d], mj.dof_armature[d], mj.jnt_stiffness[j], mj.qpos_spring[q] - zero,
      *(mj.jnt_range[j] - zero), mj.jnt_solimp[j][0], mj.jnt_solref[j][0], *mj.actuator_biasprm[0][:2],
      mj.actuator_forcerange[0][0], mj.nu)
"""


def in_newton(code: str, path: Path, variant: str, *numbers: float) -> list[float]:
    """The output of code about a stage in Newton's MuJoCo solver on the CPU, without gravity, in its own process."""
    words = [python_with("newton"), "-c", NEWTON + code, str(path), variant, *map(str, numbers)]
    ended = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)
    assert ended.returncode == 0, ended.stderr[-2000:]
    return [float(word) for word in ended.stdout.splitlines()[-1].split()]


@pytest.mark.system
@pytest.mark.parametrize("variant", ["physx", "mujoco"])
def test_newton_measures_the_same_decay_friction_and_state(tmp_path: Path, variant: str) -> None:
    for name in ("damped", "dry"):
        (tmp_path / name).mkdir()
    export_usd(tmp_path / "damped", arm(tmp_path / "damped", 0.3, damping=ARM_INERTIA / 0.5))
    before, _, speed = in_newton(NEWTON_RUN, tmp_path / "damped" / USD_NAME, variant, 1.0, 0.0, 0.5)
    assert before == pytest.approx(0.3 if variant == "physx" else 0.0)
    # The base is free (10 kg, 1 kg·m²): the arm of 0.5 kg and 0.1 m moves it too, and has less inertia itself for that.
    turning = 4e-4 + 0.1**2 / (1.0 / 0.5 + 1.0 / 10.0)
    effective = 1.0 / (1.0 / turning + 1.0 / 1.0)
    assert speed == pytest.approx(math.exp(-ARM_INERTIA / effective), rel=0.01)
    export_usd(tmp_path / "dry", arm(tmp_path / "dry", friction=0.02))
    _, held, _ = in_newton(NEWTON_RUN, tmp_path / "dry" / USD_NAME, variant, 0.0, 0.019, 0.5)
    _, moved, _ = in_newton(NEWTON_RUN, tmp_path / "dry" / USD_NAME, variant, 0.0, 0.023, 0.5)
    assert abs(held) < 0.02 and moved > 0.05


@pytest.mark.system
def test_newton_compiles_the_variant_for_mujoco_as_mujoco_does_our_mjcf(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    overlay = arm(tmp_path, 0.7, lower=-0.5, upper=1.5, damping=0.02, friction=0.3, stiffness=0.9, reference=0.25,
                  armature=0.03, bias=(50.0, 0.03, -1.0, 0.0))  # fmt: skip
    export_mjcf(tmp_path, overlay, 1.0 / 240.0)
    mj = mujoco.MjModel.from_xml_path(str(tmp_path / MJCF_NAME))
    lower, upper = mj.jnt_range[1] - 0.7
    ours = [mj.dof_damping[6], mj.dof_frictionloss[6], mj.dof_armature[6], mj.jnt_stiffness[1],
            mj.qpos_spring[7] - 0.7, lower, upper, mj.jnt_solimp[1][0], mj.jnt_solref[1][0],
            *mj.actuator_biasprm[0][:2], mj.actuator_forcerange[0][0], 1.0]  # fmt: skip
    found = in_newton(NEWTON_TERMS, export_usd(tmp_path, overlay).path, "mujoco")
    assert found == pytest.approx(ours, rel=1e-5, abs=1e-6)
