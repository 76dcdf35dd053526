"""A refined URDF as a MuJoCo specification that keeps its joint dynamics, and the options under which objects rest."""

from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from pathlib import Path

import mujoco
from lxml import etree

from asset2sim.assets.mujoco_options import (
    ARMATURE_LIMIT_SOLIMP,
    CONTACT_SOLIMP,
    FRICTION_RATIO,
    FRICTION_SOLIMP,
    LIMIT_SOLIMP,
    LOCKED_RANGE,
    ROLLING_DIMENSION,
    ROLLING_M,
    SOLVER_ITERATIONS,
    SOLVER_TOLERANCE,
    TORSION_M,
    bias_name,
    body_name,
    solref,
)
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.assets.urdf.read import Dynamics, passing_pairs, read_dynamics
from asset2sim.assets.urdf.references import find_mesh
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode


def exclude_related(spec: mujoco.MjSpec) -> None:
    """Exclude the contacts that MuJoCo filters where the root is free and keeps where it is held.

    MuJoCo takes links without a joint between them for one body, and filters contacts within a body and with the body
    that it is jointed to; not so where that body is welded to the world. The pairs that it would otherwise filter are
    excluded by name.
    """
    held: list[mujoco.MjsBody] = []
    jointed: list[mujoco.MjsBody] = []
    collect_held(spec.worldbody, held, jointed)
    for child in jointed:
        for parent in held:
            spec.add_exclude(bodyname1=parent.name, bodyname2=child.name)


def collect_held(body: "mujoco.MjsBody", held: "list[mujoco.MjsBody]", jointed: "list[mujoco.MjsBody]") -> None:
    """Collect the bodies welded to the world in ``held``, and those one joint away, with what is welded to them."""
    for child in body.bodies:
        if child.joints:
            jointed.extend(welded(child))
        else:
            held.append(child)
            collect_held(child, held, jointed)


def welded(body: "mujoco.MjsBody") -> "list[mujoco.MjsBody]":
    """The body and its descendants that are attached without a joint."""
    return [body, *(inner for child in body.bodies if not child.joints for inner in welded(child))]


@contextmanager
def collected_warnings() -> Iterator[list[str]]:
    """Collect MuJoCo's warnings while the block runs; the handler set before receives them too."""
    lines: list[str] = []
    before = mujoco.get_mju_user_warning()

    def hear(message: str) -> None:
        lines.append(" ".join(message.split()))
        if before is not None:
            before(message)

    mujoco.set_mju_user_warning(hear)
    try:
        yield lines
    finally:
        mujoco.set_mju_user_warning(before)


def object_spec(urdf: Path, *, free: bool, contact_friction: float) -> mujoco.MjSpec:
    """The uncompiled MuJoCo specification of a URDF, with the joint dynamics that MuJoCo's URDF reader drops.

    Links (but one named world), joints and geoms keep their URDF's names and frames, fixed joints stay, no mass is
    invented. Joints have damping, frictionloss, stiffness and springref as the URDF states them; every geom the sliding
    coefficient ``contact_friction`` (MuJoCo takes the larger of two). ``free`` puts a free joint on the root, which is
    held otherwise; links next to each other in the tree do not collide either way. Mesh bytes are in ``assets`` under
    their paths relative to the URDF's folder. Visuals are left out. Raises AssetError (engine_refused) where MuJoCo
    cannot read it."""
    root = prepared(urdf)
    try:
        with collected_warnings():
            spec = mujoco.MjSpec.from_string(etree.tostring(root).decode(), assets=mesh_bytes(root, urdf.parent))
    except (ValueError, OSError) as error:
        raise refused_error(urdf, error) from error
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.compiler.usethread = False
    for joint in spec.joints:
        joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
    give_dynamics(spec, read_dynamics(urdf))
    lock_joints(spec, root)
    for equality in spec.equalities:  # URDF's mimics
        equality.solimp = FRICTION_SOLIMP
    rolling = rolling_friction(root)
    for geom in spec.geoms:
        geom.friction = [contact_friction, TORSION_M, rolling or ROLLING_M]
        geom.condim = ROLLING_DIMENSION if rolling > 0.0 else geom.condim
    if free:
        spec.worldbody.first_body().add_freejoint(name="root")
    else:
        exclude_related(spec)
    links = [str(link.get("name")) for link in root.findall("link")]
    for pair in passing_pairs(root):
        first, second = (body_name(name, links) for name in pair)
        spec.add_exclude(bodyname1=first, bodyname2=second)
    return spec


def rolling_friction(root: "etree._Element") -> float:
    """The rolling resistance that a URDF's tree states for its contacts, m; 0 where it states none."""
    stated = root.find("link/contact/rolling_friction")
    return 0.0 if stated is None else float(stated.get("value", 0.0))


def prepared(urdf: Path) -> "etree._Element":
    """The URDF's tree with MuJoCo's compiler set as ``object_spec`` wants, meshes by plain paths, visuals left out."""
    try:
        root = deepcopy(parsed_root(urdf))
    except (etree.XMLSyntaxError, OSError) as error:
        raise refused_error(urdf, error) from error
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        # MuJoCo wants names of shapes to be unique, datasets repeat them, and nothing refers to them.
        for collision in link.findall("collision"):
            collision.attrib.pop("name", "")
    links = {str(link.get("name")) for link in root.findall("link")}
    for element in root.findall("link"):
        element.set("name", body_name(str(element.get("name")), links))
    for end in (*root.iterfind("joint/parent"), *root.iterfind("joint/child")):
        end.set("link", body_name(str(end.get("link")), links))
    for existing in root.findall("mujoco"):
        root.remove(existing)
    compiler = etree.SubElement(etree.SubElement(root, "mujoco"), "compiler")
    settings = {"strippath": "false", "fusestatic": "false", "discardvisual": "false", "balanceinertia": "false"}
    for key, value in settings.items():
        compiler.set(key, value)
    return root


def mesh_bytes(root: "etree._Element", folder: Path) -> dict[str, bytes]:
    """Mesh reference → file content, for every mesh that the tree names and that is there. Contents instead of paths:
    MuJoCo caches meshes by path, and a file that was rewritten might be read from there."""
    contents: dict[str, bytes] = {}
    for mesh in root.iter("mesh"):
        reference = str(mesh.get("filename"))
        file = find_mesh(reference, folder)
        if file is None:
            continue
        key = reference
        if "://" in reference or Path(reference).is_absolute():
            inside = file.resolve().is_relative_to(folder.resolve())
            key = file.resolve().relative_to(folder.resolve()).as_posix() if inside else file.name
            mesh.set("filename", key)
        contents.setdefault(key, file.read_bytes())
    return contents


def give_dynamics(spec: mujoco.MjSpec, terms: dict[str, Dynamics]) -> None:
    """Put the joints' damping, friction, stiffness, spring reference and armature in, and make friction and limits
    stiff. MuJoCo adds armature to the diagonal of the mass matrix, and steps springs explicitly. What a mechanism
    exerts is an actuator that no control moves, about the first of the clicks of a selector."""
    for joint in spec.joints:
        term = terms[joint.name]
        joint.damping = [term.damping, 0.0, 0.0]
        joint.frictionloss = term.friction
        joint.stiffness = [term.stiffness, 0.0, 0.0]
        joint.springref = term.spring_reference
        joint.armature = term.armature
        joint.solimp_friction = FRICTION_SOLIMP
        joint.solimp_limit = ARMATURE_LIMIT_SOLIMP if term.armature > 0.0 else LIMIT_SOLIMP
        slope, none_at, least, most, _ = term.bias
        if slope != 0.0:
            exerts = spec.add_actuator(name=bias_name(joint.name), target=joint.name)
            exerts.trntype, exerts.biastype = mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtBias.mjBIAS_AFFINE
            exerts.gainprm[0], exerts.biasprm[:2] = 0.0, (-slope * none_at, slope)
            exerts.forcelimited, exerts.forcerange = mujoco.mjtLimited.mjLIMITED_TRUE, (least, most)


def lock_joints(spec: mujoco.MjSpec, root: "etree._Element") -> None:
    """Give joints with equal limits the range ``LOCKED_RANGE``."""
    for element in root.findall("joint"):
        limit = element.find("limit")
        if limit is None or element.get("type") not in ("revolute", "prismatic"):
            continue
        lower, upper = float(limit.get("lower", 0.0)), float(limit.get("upper", 0.0))
        if lower == upper:
            joint = spec.joint(str(element.get("name")))
            joint.range = [lower, lower + LOCKED_RANGE]
            joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE


def give_options(spec: mujoco.MjSpec, timestep_s: float, gravity_m_s2: float) -> None:
    """Set solver options: objects rest without creeping, are stable at 1/60 s, and explosions are not hidden.

    The integrator ``implicitfast`` takes joint damping implicitly, so that no damping is too large for a step. Newton's
    solver with elliptic cones converges to the exact solution of a step; ``FRICTION_RATIO`` keeps friction from
    creeping. Constraints have time constants of ``REFERENCE_STEPS`` steps, scaled by MuJoCo's own estimate of what they
    move: with the exact figure (diagexact) the solver did not converge where four drawers met their stops at once, and
    threw them at 200 m/s. The reset of a state that is no longer a number is off: it would hide an explosion.
    """
    option = spec.option
    option.timestep = timestep_s
    option.gravity = [0.0, 0.0, -gravity_m_s2]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = FRICTION_RATIO
    option.iterations = SOLVER_ITERATIONS
    option.tolerance = SOLVER_TOLERANCE
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    for joint in spec.joints:
        joint.solref_friction = joint.solref_limit = solref(timestep_s)
    for equality in spec.equalities:
        equality.solref = solref(timestep_s)
    for geom in spec.geoms:
        geom.solref = solref(timestep_s)
        geom.solimp = CONTACT_SOLIMP


def compiled_model(spec: mujoco.MjSpec, urdf: Path) -> mujoco.MjModel:
    """The model of a URDF's specification. Raises AssetError (engine_refused) with MuJoCo's message."""
    try:
        return spec.compile()
    except (ValueError, OSError) as error:
        raise refused_error(urdf, error) from error


def refused_error(urdf: Path, error: Exception) -> AssetError:
    """AssetError (engine_refused) with MuJoCo's message."""
    said = " ".join(str(error).split())[:400]
    return AssetError(FailureMode.ENGINE_REFUSED, "engine_refused", f"MuJoCo refuses {urdf.name} and says: {said}")
