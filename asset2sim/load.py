"""Load a refined object into an engine with everything set that a URDF cannot say. One file that needs nothing of us.

A run writes this module beside its objects as ``OUT/assets/load.py``. It imports the standard library, numpy, and the
engine that is asked for::

    from load import describe, load

    print(describe("OUT/assets/7236"))                   # joints, ranges, what holds, where to pull, support, mass
    item = load("OUT/assets/7236", engine="mujoco")      # item.model, item.data: the engine's own handles
    item.step()                                          # or the engine's own step; item.positions() by joint name

Set are: initial state, no motors, joint damping, dry friction, springs and references, armature, friction and rolling
friction of contacts (as far as the engine has it), the base (held where the object is fixed to something), and, in a
world that ``load`` makes, a floor at z = 0, gravity, and the time step and solver under which the object stays as it is
asked to be. ``into`` puts it into a world of yours, whose floor, gravity, time step and solver stay. Lengths are in m,
angles in rad, quaternions wxyz.

| engine | the handles of what you get | ``into`` takes | and then |
|---|---|---|---|
| pybullet | ``client``, ``body``, ``joints`` (name → index), ``drive`` | a client's id | ``drive()`` before each step |
| mujoco | ``spec``, ``model``, ``data`` | an ``MjSpec`` | ``finish(model, data)`` once you compiled it |
| sapien | ``scene``, ``articulation`` | a ``Scene`` | |
| drake | ``plant``, ``instance``, ``diagram``, ``simulator`` | (builder, plant) | ``finish()`` after ``Finalize()`` |
| genesis | ``scene``, ``entity`` | a ``Scene`` | ``finish()`` after ``scene.build()`` |
| newton | ``builder``, ``model``, ``solver``, ``states``, ``control`` | a ``ModelBuilder`` | use ``SolverMuJoCo`` |
"""

import json
import math
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

GRAVITY = (0.0, 0.0, -9.81)  # m/s²
STOP_DAMPING = 1e8  # of drives that are dry friction, N·m·s/rad or N·s/m: a held joint creeps at its load over this
PACKAGES = {"pydrake": "drake", "genesis": "genesis-world", "newton": "newton[sim]", "mujoco_warp": "newton[sim]"}
UNSET: Any = None  # a handle that is not there yet: the world that it is of is not compiled
HANDLES = ("handle", "knob", "pull", "grip", "lever", "latch", "strap")  # names of visuals that hands take begin so


class LoadError(RuntimeError):
    """The folder is no refined object, or holds what cannot be loaded; says what to do."""


@dataclass(frozen=True)
class Joint:
    """One movable joint; ``unit`` is rad or m, ``lower`` and ``upper`` are None where it turns for ever. ``pull`` is a
    point to take hold of, m in the frame of ``link``: the middle of a handle, else of the edge that moves furthest.
    ``mimic``: the joint that it follows, multiplier, offset. Effective inertia and load are of the initial state."""

    name: str
    type: str
    label: str
    unit: str
    link: str
    lower: float | None
    upper: float | None
    initial_position: float
    holds: bool
    damping: float
    friction: float
    stiffness: float
    spring_reference: float
    effective_inertia: float
    gravity_load: float
    armature: float = 0.0
    mimic: tuple[str, float, float] | None = None
    pull: tuple[float, ...] | None = None

    def __str__(self) -> str:
        ends = "endless" if self.lower is None or self.upper is None else f"{self.lower:.4g} to {self.upper:.4g}"
        pull = "" if self.pull is None else f", pull {self.link} at ({', '.join(f'{v:.3f}' for v in self.pull)}) m"
        does = f"starts at {self.initial_position:.4g}, {'holds' if self.holds else 'moves freely'}"
        return f"{self.name} ({self.label or self.link}): {self.type}, {ends} {self.unit}, {does}{pull}"


@dataclass(frozen=True)
class Description:
    """Description of a refined object. ``support`` is freestanding, fixed or handheld; ``mount`` what a fixed
    one is fixed to, if known; ``height_m`` how far its root's origin is over its lowest point in the initial state;
    ``urdf`` its URDF's tree with absolute paths."""

    asset_id: str
    folder: Path
    root: str
    mass_kg: float
    support: str
    mount: str | None
    contact_friction: float
    rolling_friction_m: float
    height_m: float
    joints: tuple[Joint, ...]
    urdf: ET.Element = field(repr=False)

    def __str__(self) -> str:
        first = f"{self.asset_id}: {self.mass_kg:.3g} kg, {self.support}{f' to {self.mount}' if self.mount else ''}"
        return "\n  ".join((first, *(str(joint) for joint in self.joints)))


class Root(NamedTuple):
    """Whether the root is held to the world, and its frame's position (m) and orientation (wxyz)."""

    fixed: bool
    position: tuple[float, float, float]
    wxyz: tuple[float, float, float, float]


@dataclass(frozen=True)
class Loaded:
    """An object in an engine, whose ``handles`` are attributes too; ``step`` advances it by one time step. ``finish``,
    where it was put ``into`` a world of yours, does what the engine takes only once that is compiled."""

    about: Description
    handles: dict[str, Any]
    read: Callable[[], Sequence[float]]
    step: Callable[[], object]
    finish: Callable[..., object] = lambda: None

    def __getattr__(self, name: str) -> Any:
        if name == "handles" or name not in self.handles:
            raise AttributeError(f"no '{name}'; the engine's handles are {', '.join(self.__dict__.get('handles', ()))}")
        return self.handles[name]

    def positions(self) -> dict[str, float]:
        """Joint → position, rad or m."""
        return {joint.name: float(q) for joint, q in zip(self.about.joints, self.read(), strict=True)}


def load(
    folder: str | Path, engine: str = "pybullet", *, into: Any = None, position: Sequence[float] = (0.0, 0.0),
    yaw: float = 0.0, fixed: bool | None = None, timestep_s: float = 1.0 / 240.0,
) -> Loaded:  # fmt: skip
    """A refined object in an engine, in its initial state, with the engine's own handles (see the module).

    ``position`` is (x, y), the object standing on z = 0, or (x, y, z) of its root's origin; ``yaw`` turns it about the
    vertical, rad. ``fixed`` holds the root or frees it; None does as the object's support says. Raises LoadError for a
    folder or engine that is none, ImportError where the engine is not installed. Checked at the default time step."""
    if engine not in ENGINES:
        raise LoadError(f"no engine '{engine}'; choose one of {', '.join(ENGINES)}")
    about = describe(folder)
    x, y, z = (*(float(value) for value in position), about.height_m)[:3]
    held = about.support == "fixed" if fixed is None else fixed
    root = Root(held, (x, y, z), (math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)))
    return ENGINES[engine](about, root, into, timestep_s)


def module(name: str) -> Any:
    """An engine's module. Raises ImportError with the package to install (``PACKAGES``, where it has another name)."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        missing = str(error.name).partition(".")[0]
        package = PACKAGES.get(missing, missing)
        raise ImportError(f"{name} needs {missing}, which is not installed: pip install '{package}'") from error


def describe(folder: str | Path) -> Description:
    """Description of a refined folder: joints with range, unit, initial position, whether they hold and where to pull;
    support and mass. Raises LoadError where the URDF, overlay.json or a collision mesh is not there."""
    place = Path(folder).resolve()
    missing = [name for name in ("mobility.urdf", "overlay.json") if not (place / name).is_file()]
    if missing:
        raise LoadError(f"{folder} lacks {' and '.join(missing)}; name the folder of a refined object, OUT/assets/<id>")
    overlay = json.loads((place / "overlay.json").read_text(encoding="utf-8"))
    urdf = ET.parse(place / "mobility.urdf").getroot()
    # A transmission is a motor in Drake, on the joint that has friction, and an error in SAPIEN.
    urdf[:] = [element for element in urdf if element.tag != "transmission"]
    for mesh in urdf.iter("mesh"):
        mesh.set("filename", str(place / str(mesh.get("filename"))))
    elements = {str(element.get("name")): element for element in urdf.findall("joint")}
    links = {str(link.get("name")): link for link in urdf.findall("link")}
    clouds = {name: points_of(link, "collision") for name, link in links.items()}
    root = next(name for name in clouds if name not in {end(element, "child") for element in elements.values()})
    every = (*overlay["joints"], *overlay.get("followers", ()))
    terms = {item["name"]: item for item in every if item["name"] in elements}
    poses = link_poses(urdf, root, {name: item["initial_position"] for name, item in terms.items()})
    lowest = [
        float((cloud @ poses[name][2, :3]).min()) + poses[name][2, 3] for name, cloud in clouds.items() if len(cloud)
    ]
    support = overlay.get("support") or {"kind": "freestanding"}
    contact = (overlay["contact_friction"], overlay.get("rolling_friction_m", 0.0), -min(lowest, default=0.0))
    ends = {name: end(elements[name], "child") for name in terms}
    joints = tuple(joint_of(links[ends[name]], elements[name], terms[name], clouds[ends[name]]) for name in terms)
    mass_kg, carried = sum(link["mass_kg"] for link in overlay["links"]), (support["kind"], support.get("mount"))
    return Description(overlay["asset_id"], place, root, mass_kg, *carried, *contact, joints, urdf)


def joint_of(link: ET.Element, element: ET.Element, terms: dict[str, Any], cloud: np.ndarray) -> Joint:
    """One joint from the link that it moves, its URDF element, its entry in the overlay, and the link's points."""
    lead, points, mimic = element.find("mimic"), points_of(link, "visual", HANDLES), None
    if not len(points) and len(cloud):
        axis = vector(element.find("axis"), "xyz", "1 0 0")
        axis = axis / np.linalg.norm(axis) * (-1.0 if terms["open"] < terms["closed"] else 1.0)
        reach = cloud @ axis if terms["type"] == "prismatic" else np.linalg.norm(np.cross(cloud, axis), axis=1)
        points = cloud[reach >= reach.max() - 0.02 * np.ptp(cloud, axis=0).max()]
    if lead is not None:
        mimic = str(lead.get("joint")), float(lead.get("multiplier", 1.0)), float(lead.get("offset", 0.0))
    pull = tuple(((points.min(axis=0) + points.max(axis=0)) / 2.0).tolist()) if len(points) else None
    unit, known = "m" if terms["type"] == "prismatic" else "rad", {*terms} & {*Joint.__dataclass_fields__} - {"mimic"}
    return Joint(**{key: terms[key] for key in known}, unit=unit, link=str(link.get("name")), mimic=mimic, pull=pull)


def end(element: ET.Element, tag: str) -> str:
    """The link that a joint's ``<parent>`` or ``<child>`` names."""
    found = element.find(tag)
    return "" if found is None else str(found.get("link"))


def vector(element: ET.Element | None, key: str, default: str = "0 0 0") -> np.ndarray:
    """(3,) numbers of an attribute."""
    numbers = str((element is not None and element.get(key)) or default).split()
    return np.array([float(number) for number in (numbers * 3)[:3]])


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """(3, 3) rotation about an axis, by Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)


def pose_of(element: ET.Element) -> np.ndarray:
    """(4, 4) transform of an element's ``<origin>``."""
    origin, pose, (x, y, z) = element.find("origin"), np.eye(4), np.eye(3)
    roll, pitch, yaw = vector(origin, "rpy")
    pose[:3, :3] = turn(z, yaw) @ turn(y, pitch) @ turn(x, roll)
    pose[:3, 3] = vector(origin, "xyz")
    return pose


def link_poses(urdf: ET.Element, root: str, positions: dict[str, float]) -> dict[str, np.ndarray]:
    """Link → (4, 4) link-to-root transform at these joint positions."""
    poses, waiting = {root: np.eye(4)}, [root]
    for parent in waiting:
        for element in (joint for joint in urdf.findall("joint") if end(joint, "parent") == parent):
            motion, axis = np.eye(4), vector(element.find("axis"), "xyz", "1 0 0")
            position = positions.get(str(element.get("name")), 0.0)
            if element.get("type") == "prismatic":
                motion[:3, 3] = position * axis / np.linalg.norm(axis)
            elif element.get("type") != "fixed":
                motion[:3, :3] = turn(axis, position)
            poses[end(element, "child")] = poses[parent] @ pose_of(element) @ motion
            waiting.append(end(element, "child"))
    return poses


def points_of(link: ET.Element, tag: str, names: tuple[str, ...] = ("",)) -> np.ndarray:
    """(n, 3) points that span a link's shapes of this tag whose name begins so, in the link's frame, m. Raises
    LoadError for a collision mesh that is not there or no OBJ; visual ones are left out."""
    clouds = [np.zeros((0, 3))]
    for item in (one for one in link.findall(tag) if str(one.get("name", "")).lower().startswith(names)):
        pose = pose_of(item)
        for shape in item.findall("geometry/*"):
            half = np.array([0.0, 0.0, float(shape.get("length", 0.0)) / 2.0])
            if shape.tag == "mesh":
                points = mesh_points(Path(shape.get("filename", "")), tag == "collision") * vector(shape, "scale", "1")
            elif shape.tag == "box":
                points = np.array(np.meshgrid(*[(-v / 2.0, v / 2.0) for v in vector(shape, "size")])).reshape(3, -1).T
            else:  # round: a cylinder along z by its rims, a sphere or capsule by circles about x
                around = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False)
                circle = float(shape.get("radius", 0.0)) * np.stack(
                    [np.cos(around), np.sin(around), 0.0 * around], axis=1
                )
                tilts = [turn(np.eye(3)[0], tilt) for tilt in (around[:1] if shape.tag == "cylinder" else around)]
                points = np.vstack([circle @ tilt + side for tilt in tilts for side in (half, -half)])
            clouds.append(points @ pose[:3, :3].T + pose[:3, 3])
    return np.vstack(clouds)


def mesh_points(file: Path, needed: bool) -> np.ndarray:
    """(n, 3) vertices of an OBJ file, unscaled; none where it is not one that can be read and not ``needed``."""
    lines = file.read_text("utf-8", "replace").splitlines() if file.suffix.lower() == ".obj" and file.is_file() else []
    points = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], dtype=float).reshape(-1, 3)
    if needed and not len(points):
        problem = "is no OBJ; refine the object with --collision repair" if file.is_file() else "is not there"
        raise LoadError(f"collision mesh {file} {problem}")
    return points


@contextmanager
def copied(urdf: ET.Element, visuals: bool = True) -> Iterator[str]:
    """Path of a file of the URDF's tree, without its visuals if so asked, until the block ends."""
    for link in () if visuals else urdf.findall("link"):
        link[:] = [element for element in link if element.tag != "visual"]
    with tempfile.TemporaryDirectory() as folder:
        ET.ElementTree(urdf).write(Path(folder) / "mobility.urdf", encoding="utf-8")
        yield str(Path(folder) / "mobility.urdf")


def load_pybullet(about: Description, root: Root, into: Any, timestep_s: float) -> Loaded:
    """``loadURDF``; PyBullet's own motors and damping are off. Dry friction is a motor at rest whose force is bounded,
    ``drive`` sets the forces of springs for one step. Friction coefficients multiply: give a floor of yours 1."""
    bullet, mu = module("pybullet"), about.contact_friction
    client = bullet.connect(bullet.DIRECT) if into is None else int(into)
    at: dict[str, Any] = {"physicsClientId": client}
    if into is None:
        bullet.setGravity(*GRAVITY, **at)
        bullet.setTimeStep(timestep_s, **at)
        # Limits that were overshot are enforced; more rounds over joints and no early stop, or held lids creep.
        solver = {"useSplitImpulse": 0, "numNonContactInnerIterations": 4, "solverResidualThreshold": 1e-10}
        bullet.setPhysicsEngineParameter(**solver, **at)
        floor = bullet.createMultiBody(0.0, bullet.createCollisionShape(bullet.GEOM_PLANE, **at), **at)
        bullet.changeDynamics(floor, -1, lateralFriction=1.0, **at)
    flags, xyzw = bullet.URDF_USE_INERTIA_FROM_FILE | bullet.URDF_USE_SELF_COLLISION, (*root.wxyz[1:], root.wxyz[0])
    with copied(about.urdf) as path:
        body = bullet.loadURDF(path, root.position, xyzw, useFixedBase=root.fixed, flags=flags, **at)
    infos = [bullet.getJointInfo(body, index, **at) for index in range(bullet.getNumJoints(body, **at))]
    joints = {info[1].decode(): info[0] for info in infos if info[2] != bullet.JOINT_FIXED}
    for index in range(-1, len(infos)):
        still = {"linearDamping": 0.0, "angularDamping": 0.0, "jointDamping": 0.0}
        bullet.changeDynamics(body, index, lateralFriction=mu, **still, **at)
    for joint in about.joints:
        index = joints[joint.name]
        bullet.changeDynamics(body, index, maxJointVelocity=1e6, **at)  # at 100 rad/s, friction stops every tiny part
        bullet.changeDynamics(body, index, jointDamping=0.0 if joint.armature else joint.damping, **at)
        bullet.setJointMotorControl2(body, index, bullet.VELOCITY_CONTROL, force=joint.friction, **at)
        bullet.resetJointState(body, index, joint.initial_position, 0.0, **at)
        if joint.mimic is not None:  # the gear keeps the offset that the initial state has
            frames = (0, 0, 1), (0, 0, 0), (0, 0, 0)
            gear = bullet.createConstraint(body, joints[joint.mimic[0]], body, index, bullet.JOINT_GEAR, *frames, **at)
            bullet.changeConstraint(gear, gearRatio=-joint.mimic[1], maxForce=1e4, erp=0.2, **at)

    def drive() -> Any:
        step = bullet.getPhysicsEngineParameters(**at)["fixedTimeStep"]
        for joint in (one for one in about.joints if one.stiffness > 0.0):
            position, speed, *_ = bullet.getJointState(body, joints[joint.name], **at)
            spring = joint.stiffness * (joint.spring_reference - position)
            mode, control = bullet.TORQUE_CONTROL, {"force": spring}
            if joint.armature > 0.0:
                # A torque would throw a key of 1 g: the joint's own step, armature included, gives a motor's target,
                # and what spring, damper and armature exert meanwhile bounds the motor's force.
                resists = (inertia := joint.armature + joint.effective_inertia) + step * joint.damping
                target = (inertia * speed + step * spring) / resists
                target -= math.copysign(min(abs(target), step * joint.friction / resists), target)
                if joint.lower is not None and joint.upper is not None:
                    low, high = min(joint.lower - position, 0.0), max(joint.upper - position, 0.0)
                    target = min(max(target, low / step), high / step)
                exerted = spring - joint.damping * target - joint.armature * (target - speed) / step
                bound = 1.01 * max(abs(exerted), abs(spring)) + joint.friction
                mode, control = bullet.VELOCITY_CONTROL, {"targetVelocity": target, "force": bound}
            bullet.setJointMotorControl2(body, joints[joint.name], mode, **control, **at)

    handles = {"client": client, "body": body, "joints": joints, "drive": drive}
    read = lambda: [bullet.getJointState(body, joints[joint.name], **at)[0] for joint in about.joints]  # noqa: E731
    return Loaded(about, handles, read, lambda: (drive(), bullet.stepSimulation(**at)))


def object_spec(about: Description, root: Root, timestep_s: float) -> Any:
    """The object as an ``MjSpec``, its root placed, held or free: the exported ``mobility.xml``, or where there is none
    the URDF without its looks, with the joints' terms and the options that the export has."""
    mujoco, exported = module("mujoco"), about.folder / "mobility.xml"
    if exported.is_file():
        spec = mujoco.MjSpec.from_file(str(exported))
        spec.meshdir = spec.texturedir = str(about.folder)
    else:
        settings = {"strippath": "false", "fusestatic": "false", "discardvisual": "false", "balanceinertia": "false"}
        ET.SubElement(ET.SubElement(about.urdf, "mujoco"), "compiler", settings)
        with copied(about.urdf, visuals=False) as path:
            spec = mujoco.MjSpec.from_file(path)
        give_terms(mujoco, spec, about, timestep_s)
    spec.option.timestep = timestep_s
    for key in list(spec.keys):  # it is of a root either held or free
        spec.delete(key)
    body = spec.worldbody.first_body()
    body.pos, body.quat = root.position, root.wxyz
    free = [joint for joint in body.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    for joint in free if root.fixed else ():
        spec.delete(joint)
    if not free and not root.fixed:
        body.add_freejoint(name=f"{about.root}_free")
    return spec


def give_terms(mujoco: Any, spec: Any, about: Description, timestep_s: float) -> None:
    """Set what MuJoCo's URDF reader leaves out: the joints' terms, and options under which objects rest."""
    stiff, time, option = (0.9999, 0.9999, 1.0, 0.5, 2.0), (3.0 * timestep_s, 1.0), spec.option
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    option.gravity, option.impratio, option.iterations, option.tolerance = GRAVITY, 100.0, 100, 1e-10
    option.integrator, option.cone = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, mujoco.mjtCone.mjCONE_ELLIPTIC
    for term in about.joints:
        joint = spec.joint(term.name)
        joint.damping, joint.stiffness = [term.damping, 0.0, 0.0], [term.stiffness, 0.0, 0.0]
        joint.frictionloss, joint.springref, joint.armature = term.friction, term.spring_reference, term.armature
        joint.solref_friction, joint.solref_limit, joint.solimp_friction = time, time, stiff
        joint.solimp_limit = stiff if term.armature > 0.0 else (0.99, 0.99, 1.0, 0.5, 2.0)
        if term.lower is not None and term.lower == term.upper:  # MuJoCo reads this as no limit
            joint.range, joint.limited = (term.lower, term.lower + 1e-6), mujoco.mjtLimited.mjLIMITED_TRUE
    for geom in spec.geoms:
        geom.solref, geom.solimp, geom.priority = time, (0.95, 0.99, 1e-3, 0.5, 2.0), 1
        geom.friction = (about.contact_friction, 5e-3, about.rolling_friction_m or 1e-4)
        geom.condim = 6 if about.rolling_friction_m else 3
    groups: tuple[list[str], ...] = ([], [], [])  # welded to the root, one joint away, further
    waiting = [(spec.worldbody.first_body(), 0)]
    for body, away in waiting:
        groups[min(away, 2)].append(body.name)
        waiting.extend((child, away + len(child.joints)) for child in body.bodies)
    for held in groups[0]:  # contacts that MuJoCo filters, but not where the root is held to the world
        for other in groups[1]:
            spec.add_exclude(bodyname1=held, bodyname2=other)


def load_mujoco(about: Description, root: Root, into: Any, timestep_s: float) -> Loaded:
    """The object compiled with a floor; or attached to a specification of yours, names beginning with ``asset_id/``:
    impratio 100 and elliptic cones keep what stands there from creeping."""
    mujoco, spec, prefix = module("mujoco"), object_spec(about, root, timestep_s), f"{about.asset_id}/" if into else ""

    def finish(model: Any, data: Any) -> None:
        handles.update(model=model, data=data)
        for joint in about.joints:
            data.joint(prefix + joint.name).qpos[0] = joint.initial_position
        mujoco.mj_forward(model, data)

    handles: dict[str, Any] = {"spec": into or spec, "model": UNSET, "data": UNSET}
    if into is not None:
        into.attach(spec, prefix=prefix, frame=into.worldbody.add_frame())
    else:
        spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 0.05))
        spec.worldbody.add_light(pos=(0.0, 0.0, 4.0), dir=(0.0, 0.0, -1.0))
        model = spec.compile()
        finish(model, mujoco.MjData(model))
    read = lambda: [handles["data"].joint(prefix + joint.name).qpos[0] for joint in about.joints]  # noqa: E731
    return Loaded(about, handles, read, lambda: mujoco.mj_step(handles["model"], handles["data"]), finish)


def load_sapien(about: Description, root: Root, into: Any, timestep_s: float) -> Loaded:
    """SAPIEN's own loader, with looks where the scene can render. A joint's drive, at rest and of bounded force, is its
    dry friction; a second drive between the same links is damper and spring."""
    sapien, physx, scene, mu = module("sapien"), module("sapien.physx"), into, about.contact_friction
    if scene is None:
        before, config = physx.get_scene_config(), physx.PhysxSceneConfig()
        config.gravity, config.enable_tgs, config.enable_pcm = GRAVITY, False, False
        physx.set_scene_config(config)  # of the process, until the next
        scene = sapien.Scene([physx.PhysxCpuSystem()])
        physx.set_scene_config(before)
        scene.set_timestep(timestep_s)
        scene.add_ground(0.0, render=False, material=physx.PhysxMaterial(mu, mu, 0.0))
    loader, renders = scene.create_urdf_loader(), False
    loader.fix_root_link = root.fixed
    loader.set_material(mu, mu, 0.0)
    with suppress(RuntimeError):  # SAPIEN's answer where there is none
        renders = scene.get_render_system() is not None
    with copied(about.urdf, visuals=renders) as path:
        body = loader.load(path)
    body.sleep_threshold, body.solver_position_iterations = 0.0, 50  # with SAPIEN's 10, held lids creep
    for link in body.links:
        link.linear_damping = link.angular_damping = 0.0
        for shape in link.collision_shapes:
            shape.contact_offset = 5e-4  # at SAPIEN's 10 mm every part touches its neighbours
    for joint in about.joints:
        made, slides, rest = body.find_joint_by_name(joint.name), joint.unit == "m", joint.spring_reference
        made.friction, made.armature = 0.0, np.array([joint.armature], np.float32)
        made.set_drive_property(0.0, STOP_DAMPING if joint.friction > 0.0 else 0.0, joint.friction)
        made.set_drive_velocity_target(0.0)
        if joint.damping > 0.0 or joint.stiffness > 0.0:
            frames = made.parent_link.entity, made.pose_in_parent, made.child_link.entity, made.pose_in_child
            drive = scene.create_drive(*frames)
            (drive.set_drive_property_x if slides else drive.set_drive_property_twist)(joint.stiffness, joint.damping)
            turned = [1.0, 0.0, 0.0, 0.0] if slides else [math.cos(rest / 2.0), math.sin(rest / 2.0), 0.0, 0.0]
            drive.set_drive_target(sapien.Pose([rest if slides else 0.0, 0.0, 0.0], turned))
    initial = {joint.name: joint.initial_position for joint in about.joints}
    order = [joint.name for joint in body.active_joints]
    body.set_qpos(np.array([initial[name] for name in order], np.float32))
    body.set_root_pose(sapien.Pose(root.position, root.wxyz))
    read = lambda: [body.qpos[order.index(joint.name)] for joint in about.joints]  # noqa: E731
    return Loaded(about, {"scene": scene, "articulation": body}, read, scene.step)


def load_drake(about: Description, root: Root, into: Any, timestep_s: float) -> Loaded:
    """Drake's URDF parser. It has no joint friction: a drive at rest whose effort is bounded, solved implicitly by a
    discrete plant, is one. Springs are force elements, armature is the drive's rotor inertia."""
    drake, mu, diagram, simulator = module("pydrake.all"), about.contact_friction, UNSET, UNSET
    builder, plant = into or (drake.DiagramBuilder(), None)
    if plant is None:
        config = drake.MultibodyPlantConfig(time_step=timestep_s, discrete_contact_approximation="sap")
        plant, scene = drake.AddMultibodyPlant(config, builder)
        soft = {"compliance_type": "compliant", "hydroelastic_modulus": 1e8}  # else shapes touch at single points
        scene.set_config(drake.SceneGraphConfig(default_proximity_properties=drake.DefaultProximityProperties(**soft)))
        plant.mutable_gravity_field().set_gravity_vector(GRAVITY)
        floor, below = drake.Box(20.0, 20.0, 1.0), drake.RigidTransform([0.0, 0.0, -0.5])
        plant.RegisterCollisionGeometry(plant.world_body(), below, floor, "floor", drake.CoulombFriction(mu, mu))
    with copied(drake_urdf(about.urdf, mu)) as path:
        (instance,) = drake.Parser(plant).AddModels(path)
    base, turned = plant.GetBodyByName(about.root, instance), drake.Quaternion(root.wxyz)
    pose = drake.RigidTransform(turned, root.position)
    if root.fixed:
        plant.WeldFrames(plant.world_frame(), base.body_frame(), pose)
    else:
        plant.SetDefaultFloatingBaseBodyPose(base, pose)
    made = {joint.name: plant.GetJointByName(joint.name, instance) for joint in about.joints}
    for joint in about.joints:
        made[joint.name].set_default_positions([joint.initial_position])
        made[joint.name].set_default_damping_vector([joint.damping])
        drive = plant.AddJointActuator(f"{joint.name}_friction", made[joint.name], max(joint.friction, 1e-12))
        drive.set_controller_gains(drake.PdControllerGains(p=0.0, d=STOP_DAMPING))
        drive.set_default_rotor_inertia(joint.armature)
        if joint.stiffness > 0.0:
            spring = drake.PrismaticSpring if joint.unit == "m" else drake.RevoluteSpring
            plant.AddForceElement(spring(made[joint.name], joint.spring_reference, joint.stiffness))

    def finish() -> None:
        port = plant.get_desired_state_input_port(instance)
        builder.Connect(builder.AddSystem(drake.ConstantVectorSource(np.zeros(port.size()))).get_output_port(), port)

    def read() -> list[float]:
        context = plant.GetMyContextFromRoot(simulator.get_context())
        return [made[joint.name].GetOnePosition(context) for joint in about.joints]

    if into is None:
        plant.Finalize()
        finish()
        diagram = builder.Build()
        simulator = drake.Simulator(diagram)
        simulator.Initialize()
    handles = {"plant": plant, "instance": instance, "diagram": diagram, "simulator": simulator}
    steps: Callable[[], int] = lambda: round(simulator.get_context().get_time() / timestep_s)  # noqa: E731
    return Loaded(about, handles, read, lambda: simulator.AdvanceTo((steps() + 1) * timestep_s), finish)


def drake_urdf(urdf: ET.Element, mu: float) -> ET.Element:
    """The tree with contact friction as Drake reads it, without names of shapes, which datasets repeat and Drake
    refuses."""
    urdf.set("xmlns:drake", "http://drake.mit.edu")
    for shape in (*urdf.iter("visual"), *urdf.iter("collision")):
        shape.attrib.pop("name", None)
        contact = ET.SubElement(shape, "drake:proximity_properties")
        ET.SubElement(contact, "drake:mu_static", value=repr(mu))
        ET.SubElement(contact, "drake:mu_dynamic", value=repr(mu))
    return urdf


def load_genesis(about: Description, root: Root, into: Any, timestep_s: float) -> Loaded:
    """Genesis' MJCF reader: its poses add to the file's; its springs pull to zero, so drives pull to the reference."""
    genesis, scene = module("genesis"), into
    spec = object_spec(about, root._replace(position=(0.0, 0.0, 0.0), wxyz=(1.0, 0.0, 0.0, 0.0)), timestep_s)
    if scene is None:
        with suppress(genesis.GenesisException):  # it is initialised already
            genesis.init(backend=genesis.cpu, logging_level="error", precision="64")
        rigid = genesis.options.RigidOptions(integrator=genesis.integrator.implicitfast)
        sim = genesis.options.SimOptions(dt=timestep_s, gravity=GRAVITY)
        scene = genesis.Scene(sim_options=sim, rigid_options=rigid, show_viewer=False)
        scene.add_entity(genesis.morphs.Plane())
    for joint in spec.joints:  # Genesis takes a limit's impedance for friction too: softer, a held lid creeps
        joint.solimp_limit = (0.9999, 0.9999, 1.0, 0.5, 2.0)
    spec.compile()
    placed = {"pos": root.position, "quat": root.wxyz, "default_armature": 0.0}
    morph = genesis.morphs.MJCF(file=ET.fromstring(spec.to_xml()), **placed)
    entity = scene.add_entity(morph, material=genesis.materials.Rigid(friction=about.contact_friction))

    def finish() -> None:
        dofs = [dof for joint in about.joints for dof in entity.get_joint(joint.name).dofs_idx_local]
        entity.set_dofs_position([joint.initial_position for joint in about.joints], dofs)
        entity.set_dofs_kp([joint.stiffness for joint in about.joints], dofs)
        for setting in (entity.set_dofs_stiffness, entity.set_dofs_kv):
            setting([0.0] * len(dofs), dofs)
        for joint, dof in ((one, at) for one, at in zip(about.joints, dofs, strict=True) if one.stiffness > 0.0):
            entity.set_dofs_force_range([-math.inf], [math.inf], [dof])
            entity.control_dofs_position([joint.spring_reference], [dof])

    if into is None:
        scene.build()
        finish()
    joints = [joint.name for joint in about.joints]
    read = lambda: [entity.get_dofs_position(entity.get_joint(name).dofs_idx_local) for name in joints]  # noqa: E731
    return Loaded(about, {"scene": scene, "entity": entity}, read, scene.step, finish)


def load_newton(about: Description, root: Root, into: Any, timestep_s: float) -> Loaded:
    """Newton's MJCF importer and its MuJoCo solver, which takes all terms; on the CPU that is MuJoCo itself."""
    newton, _, spec = module("newton"), module("mujoco_warp"), object_spec(about, root, timestep_s)
    builder, model, solver, states, control = into or newton.ModelBuilder(), UNSET, UNSET, UNSET, UNSET
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
    first = len(builder.joint_label)
    spec.compile()
    builder.add_mjcf(spec.to_xml())
    labels = [str(label).rpartition("/")[2] for label in builder.joint_label]
    places = [builder.joint_q_start[labels.index(joint.name, first)] for joint in about.joints]
    for joint, place in zip(about.joints, places, strict=True):
        builder.joint_q[place] = joint.initial_position
    if into is None:
        builder.add_ground_plane()
        model = builder.finalize()
        solver = newton.solvers.SolverMuJoCo(model, use_mujoco_cpu=not model.device.is_cuda)
        states, control = [model.state(), model.state()], model.control()
        newton.eval_fk(model, model.joint_q, model.joint_qd, states[0])

    step = lambda: (solver.step(*states, control, None, timestep_s), states.reverse())  # noqa: E731
    handles = {"builder": builder, "model": model, "solver": solver, "states": states, "control": control}
    return Loaded(about, handles, lambda: states[0].joint_q.numpy()[places], step)


NAMES = ("pybullet", "mujoco", "sapien", "drake", "genesis", "newton")
ENGINES: dict[str, Callable[..., Loaded]] = {name: globals()[f"load_{name}"] for name in NAMES}
