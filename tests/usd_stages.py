"""Ten articulations in USD, written as three kinds of tools write them, each with the numbers that must come of it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

DEGREE = math.pi / 180.0
HALF = math.sqrt(0.5)
Numbers = Mapping[str, float | str]


@dataclass(frozen=True)
class Stage:
    """Files of an asset; of each joint what a URDF must say (rad or m, N·m or N), of each link its mass, kg, and of
    those whose material says it the friction and restitution of their contacts."""

    files: Mapping[str, str]
    joints: Mapping[str, Numbers]
    masses: Mapping[str, float]
    root: str
    notes: Sequence[str] = field(default=())
    contacts: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def usda(*prims: str, up: str = "Z", metres: float | None = 1.0, kilograms: float = 1.0, default: str = "Thing") -> str:
    """A layer's text."""
    unit = "" if metres is None else f"metersPerUnit = {metres}\n"
    head = f'defaultPrim = "{default}"\nupAxis = "{up}"\nkilogramsPerUnit = {kilograms}\n{unit}'
    return f"#usda 1.0\n(\n{head})\n" + "\n".join(prims)


def prim(kind: str, name: str, *inside: str, apis: Sequence[str] = (), more: str = "") -> str:
    """A prim with applied schemas and further metadata."""
    listed = ", ".join(f'"{api}"' for api in apis)
    head = (f"prepend apiSchemas = [{listed}]\n" if apis else "") + more
    return f'def {kind} "{name}"' + (f" (\n{head}\n)" if head else "") + " {\n" + "\n".join(inside) + "\n}"


def at(xyz: Sequence[float], wxyz: Sequence[float] | None = None, scale: Sequence[float] | None = None) -> str:
    """A place by translation, orientation and scale, as physics tools write it."""
    ops = {"translate": ("double3", xyz), "orient": ("quatd", wxyz), "scale": ("double3", scale)}
    given = {name: (kind, value) for name, (kind, value) in ops.items() if value is not None}
    lines = [f"{kind} xformOp:{name} = {numbers(value)}" for name, (kind, value) in given.items()]
    order = ", ".join(f'"xformOp:{name}"' for name in given)
    return "\n".join([*lines, f"uniform token[] xformOpOrder = [{order}]"])


def numbers(values: Sequence[float]) -> str:
    return f"({', '.join(repr(float(value)) for value in values)})"


def body(
    name: str,
    *inside: str,
    mass: float,
    com: Sequence[float] = (0, 0, 0),
    moments: Sequence[float] = (1, 1, 1),
    axes: Sequence[float] | None = None,
    apis: Sequence[str] = (),
) -> str:
    """A rigid body with its stated mass."""
    lines = [f"float physics:mass = {mass}", f"point3f physics:centerOfMass = {numbers(com)}",
        f"float3 physics:diagonalInertia = {numbers(moments)}"]  # fmt: skip
    if axes is not None:
        lines.append(f"quatf physics:principalAxes = {numbers(axes)}")
    return prim("Xform", name, *lines, *inside, apis=("PhysicsRigidBodyAPI", "PhysicsMassAPI", *apis))


def joint(
    kind: str,
    name: str,
    ends: Sequence[str],
    *inside: str,
    frame0: str = "",
    frame1: str = "",
    apis: Sequence[str] = (),
) -> str:
    """A joint between two paths, of which an empty one is the world; frames are ``pos`` or ``pos|wxyz`` in words."""
    lines = [f"rel physics:body{side} = <{path}>" for side, path in enumerate(ends) if path]
    for side, frame in enumerate((frame0, frame1)):
        place, _, turn = frame.partition("|")
        for type_, word, text in (("point3f", "Pos", place), ("quatf", "Rot", turn)):
            if text:
                lines.append(f"{type_} physics:local{word}{side} = {numbers([float(v) for v in text.split()])}")
    return prim(f"Physics{kind}Joint", name, *lines, *inside, apis=apis)


def limits(lower: float, upper: float, axis: str) -> str:
    return (
        f'float physics:lowerLimit = {lower}\nfloat physics:upperLimit = {upper}\nuniform token physics:axis = "{axis}"'
    )


def drive(word: str, stiffness: float, damping: float, target: float = 0.0, most: float = math.inf) -> str:
    """A drive's attributes, as UsdPhysics counts them: per degree, where it turns."""
    values = {"stiffness": stiffness, "damping": damping, "targetPosition": target, "maxForce": most}
    return "\n".join(f"float drive:{word}:physics:{name} = {value}" for name, value in values.items())


def plate(name: str, size: Sequence[float], *inside: str, place: str = "", collides: bool = True) -> str:
    """A closed box as a mesh of quads, and how it collides."""
    x, y, z = (float(edge) / 2.0 for edge in size)
    points = ", ".join(numbers((i, j, k)) for i in (-x, x) for j in (-y, y) for k in (-z, z))
    faces = "0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3"
    lines = [f"point3f[] points = [{points}]", f"int[] faceVertexIndices = [{faces}]",
        "int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]", 'uniform token subdivisionScheme = "none"',
        place]  # fmt: skip
    apis = ("PhysicsCollisionAPI", "PhysicsMeshCollisionAPI") if collides else ()
    lines += ['uniform token physics:approximation = "convexHull"'] if collides else []
    return prim("Mesh", name, *lines, *inside, apis=apis)


def isaac(*inside: str, library: str = "") -> Mapping[str, str]:
    """One file of Isaac Sim's URDF importer: bodies flat under the root, joints beside them."""
    root = prim("Xform", "Thing", *inside, apis=("PhysicsArticulationRootAPI", "PhysxArticulationAPI"))
    return {"thing.usda": usda(root, library)}


def isaac_cabinet() -> Stage:
    """A door and a drawer; geometry by instances of prototypes beside the robot, as the importer shares meshes."""
    library = prim("Scope", "visuals", prim("Xform", "door", plate("mesh_0", (0.02, 0.4, 0.5), collides=False)),
        more="active = true")  # fmt: skip
    shared = prim("Xform", "visuals", more="instanceable = true\nprepend references = </visuals/door>")
    hinge = joint("Revolute", "door_hinge", ("/Thing/body", "/Thing/door"), limits(-5.0, 95.0, "Z"), drive("angular",
        0.0, 0.02, most=30.0), "float physxJoint:maxJointVelocity = 180", "float physxJoint:armature = 0.004",
        "float physxJoint:jointFriction = 0.0", "float physxJointAxis:angular:staticFrictionEffort = 0.15",
        "float state:angular:physics:position = 20", "float state:angular:physics:velocity = 3",
        frame0="0.21 -0.25 0|0.7071067811865476 0 0 0.7071067811865476", frame1="0 -0.2 0",
        apis=("PhysicsDriveAPI:angular", "PhysxJointAPI", "PhysicsJointStateAPI:angular"))  # fmt: skip
    slide = joint("Prismatic", "drawer_slide", ("/Thing/body", "/Thing/drawer"), limits(0.0, 0.3, "X"),
        drive("linear", 12.0, 3.0, 0.05), frame0="0.2 0.1 0.4", frame1="-0.1 0 0",
        apis=("PhysicsDriveAPI:linear",))  # fmt: skip
    foot = joint("Fixed", "root_joint", ("", "/Thing/body"))
    return Stage(isaac(body("body", plate("mesh", (0.4, 0.5, 0.9)), mass=20.0, moments=(2.0, 1.5, 1.0)), body("door",
        at((0.21, -0.05, 0.3), (0.9, 0.0, 0.0, math.sqrt(0.19))), shared, mass=2.5, com=(0.01, 0.02, 0.03),
        moments=(0.03, 0.02, 0.04), axes=(HALF, HALF, 0.0, 0.0)), body("drawer", at((0.3, 0.1, 0.4)), plate("mesh",
        (0.2, 0.4, 0.1)), mass=1.5, moments=(0.02, 0.03, 0.04)), prim("Scope", "joints", foot, hinge, slide),
        library=library), {"door_hinge": {"type": "revolute", "lower": -5.0 * DEGREE, "upper": 95.0 * DEGREE,
        "damping": 0.02 / DEGREE, "friction": 0.15, "effort": 30.0, "velocity": math.pi, "armature": 0.004,
        "start": 20.0 * DEGREE},
        "drawer_slide": {"type": "prismatic", "lower": 0.0, "upper": 0.3, "damping": 3.0, "spring_stiffness": 12.0,
        "spring_reference": 0.05}}, {"body": 20.0, "door": 2.5, "drawer": 1.5}, "body",
        ("the bodies of joint /Thing/joints/door_hinge stand 0.347 m and 0 degrees off its frames, and are put there",
        "link 'body' is fixed to the world"))  # fmt: skip


def isaac_gripper() -> Stage:
    """Two sliders, the second following the first, and a dial that follows it in degrees per metre."""
    follow = "rel physxMimicJoint:rotX:referenceJoint = </Thing/joints/left>"
    parts = [body(name, at((0.0, y, 0.1)), plate("mesh", (0.02, 0.01, 0.06)), mass=0.05, moments=(1e-5, 2e-5,
        3e-5)) for name, y in (("left_finger", 0.02), ("right_finger", -0.02), ("dial", 0.1))]  # fmt: skip
    left = joint("Prismatic", "left", ("/Thing/palm", "/Thing/left_finger"), limits(0.0, 0.03, "Y"),
        frame0="0 0.02 0.1")  # fmt: skip
    right = joint("Prismatic", "right", ("/Thing/palm", "/Thing/right_finger"), limits(-0.03, 0.0, "Y"), follow,
        "float physxMimicJoint:rotX:gearing = 1.0", frame0="0 -0.02 0.1")  # fmt: skip
    dial = joint("Revolute", "dial_turn", ("/Thing/palm", "/Thing/dial"), limits(-math.inf, math.inf, "Z"), follow,
        "float physxMimicJoint:rotX:gearing = -900.0", "float physxMimicJoint:rotX:offset = -18.0",
        frame0="0 0.1 0.1")  # fmt: skip
    palm = body("palm", plate("mesh", (0.1, 0.1, 0.05)), mass=0.5, moments=(1e-3, 1e-3, 1e-3))
    return Stage(isaac(palm, *parts, prim("Scope", "joints", left, right, dial)), {"left": {"type": "prismatic",
        "lower": 0.0, "upper": 0.03}, "right": {"type": "prismatic", "lower": -0.03, "upper": 0.0, "mimic": "left",
        "multiplier": -1.0}, "dial_turn": {"type": "continuous", "mimic": "left", "multiplier": 900.0 * DEGREE,
        "offset": 18.0 * DEGREE}}, {"palm": 0.5, "left_finger": 0.05, "right_finger": 0.05, "dial": 0.05},
        "palm")  # fmt: skip


def isaac_pendulum() -> Stage:
    """An arm on the world, which is its joint's second side, and a bob whose joint limits make a hinge."""
    swing = joint("Revolute", "swing", ("/Thing/arm", ""), limits(-60.0, 60.0, "Y"), frame0="0 0 0.4",
        frame1="0.5 0.2 1.4")  # fmt: skip
    locked = [f"float limit:{name}:physics:low = 1\nfloat limit:{name}:physics:high = -1" for name in ("transX",
        "transY", "transZ", "rotX", "rotZ")]  # fmt: skip
    turn = joint("", "turn", ("/Thing/arm", "/Thing/bob"), *locked, drive("rotY", 0.001, 0.0002),
        "float limit:rotY:physics:low = -30\nfloat limit:rotY:physics:high = 40", frame0="0 0 -0.4",
        apis=("PhysicsLimitAPI:rotY", "PhysicsDriveAPI:rotY"))  # fmt: skip
    bob = prim("Sphere", "ball", "double radius = 0.05", apis=("PhysicsCollisionAPI",))
    return Stage(isaac(body("arm", at((0.5, 0.2, 1.0)), plate("mesh", (0.02, 0.02, 0.8)), mass=0.4, moments=(0.02,
        0.02, 1e-4)), body("bob", at((0.5, 0.2, 0.6)), bob, mass=1.0, moments=(1e-3, 1e-3, 1e-3)), swing, turn),
        {"swing": {"type": "revolute", "lower": -60 * DEGREE, "upper": 60 * DEGREE}, "turn": {"type": "revolute",
        "lower": -30 * DEGREE, "upper": 40 * DEGREE, "spring_stiffness": 0.001 / DEGREE,
        "damping": 0.0002 / DEGREE}}, {"arm": 0.4, "bob": 1.0}, "base")  # fmt: skip


def simready_oven() -> Stage:
    """Centimetres, y up, bodies nested, a body's geometry by a payload of another file, which is in its own scale."""
    hinge = joint("Revolute", "hinge", ("/Thing/oven", "/Thing/oven/door"), limits(0.0, 90.0, "X"), drive("angular",
        50.0, 200.0, 10.0, 1.0e5), "float physxJoint:armature = 40", frame0="0 5 30", frame1="0 -20 0",
        apis=("PhysicsDriveAPI:angular",))  # fmt: skip
    rack = joint("Prismatic", "rack_slide", ("/Thing/oven", "/Thing/oven/rack"), limits(0.0, 25.0, "Z"),
        drive("linear", 0.0, 300.0, most=5000.0), "float state:linear:physics:position = 5", frame0="0 25 0",
        apis=("PhysicsDriveAPI:linear", "PhysicsJointStateAPI:linear"))  # fmt: skip
    door = body("door", at((0.0, 25.0, 30.0)), prim("Xform", "look", at((0, 0, 0), scale=(0.1, 0.1, 0.1)),
        more="prepend payload = @./parts/door.usda@"), mass=4.0, com=(0.0, 1.0, -0.5), moments=(600.0, 500.0,
        900.0), axes=(0.9, 0.1, 0.3, math.sqrt(0.09)))  # fmt: skip
    shelf = body("rack", at((0.0, 25.0, 0.0)), plate("mesh", (40.0, 1.0, 30.0)), mass=1.0, moments=(80.0, 200.0, 120.0))
    oven = body("oven", plate("mesh", (60.0, 50.0, 55.0), place=at((0, 25, 0))), door, shelf, mass=30.0, com=(0.0,
        24.0, 0.0), moments=(1.0e4, 1.1e4, 1.2e4))  # fmt: skip
    part = usda(plate("Door", (500.0, 400.0, 30.0)), up="Y", metres=0.001, default="Door")
    return Stage({"oven.usda": usda(prim("Xform", "Thing", oven, hinge, rack), up="Y", metres=0.01),
        "parts/door.usda": part}, {"hinge": {"type": "revolute", "lower": 0.0, "upper": 90 * DEGREE,
        "spring_stiffness": 50e-4 / DEGREE, "damping": 200e-4 / DEGREE, "spring_reference": 10 * DEGREE,
        "effort": 10.0, "armature": 40e-4}, "rack_slide": {"type": "prismatic", "lower": 0.0, "upper": 0.25,
        "damping": 300.0, "effort": 50.0, "start": 0.05}}, {"oven": 30.0, "door": 4.0, "rack": 1.0},
        "oven")  # fmt: skip


def simready_bin() -> Stage:
    """Millimetres and grams, z up, a lid under a scaled and turned group with a pivot, joined from the lid's side."""
    group = (
        "double3 xformOp:translate:pivot = (0, 200, 0)\nfloat xformOp:rotateZ = 30\n"
        "double3 xformOp:scale = (2, 2, 2)\ndouble3 xformOp:translate = (0, 0, 10)\nuniform token[] xformOpOrder = "
        '["xformOp:translate", "xformOp:translate:pivot", "xformOp:rotateZ", "xformOp:scale", '
        '"!invert!xformOp:translate:pivot"]'
    )
    lid = body("lid", at((0.0, 0.0, 200.0), (HALF, 0.0, 0.0, HALF)), plate("mesh", (150.0, 150.0, 5.0)), mass=300.0,
        com=(10.0, 0.0, 0.0), moments=(2.0e6, 2.5e6, 4.0e6))  # fmt: skip
    hinge = joint("Revolute", "lid_hinge", ("/Thing/group/lid", "/Thing/group/tub"), limits(-80.0, 0.0, "X"),
        frame0="0 75 0", frame1="0 75 200|0.9238795325112867 0 0 0.3826834323650898")  # fmt: skip
    tub = body("tub", plate("mesh", (150.0, 150.0, 200.0), place=at((0, 0, 100))), mass=1200.0, moments=(9e6, 9e6, 8e6))
    return Stage({"bin.usda": usda(prim("Xform", "Thing", prim("Xform", "group", group, tub, lid), hinge),
        metres=0.001, kilograms=0.001)}, {"lid_hinge": {"type": "revolute", "lower": -80 * DEGREE, "upper": 0.0}},
        {"tub": 1.2, "lid": 0.3}, "lid",
        ("the bodies of joint /Thing/lid_hinge stand 0.212 m and 45 degrees off its frames, and are put there",)
        )  # fmt: skip


def simready_lamp() -> Stage:
    """An arm whose mass comes of the density of its material, below a variant that is chosen, and a shade on a ball."""
    steel = prim("Material", "steel", "float physics:density = 7800", "float physics:dynamicFriction = 0.4",
        "float physics:restitution = 0.3", apis=("PhysicsMaterialAPI",))  # fmt: skip
    rod = prim("Cylinder", "rod", "double radius = 0.01", "double height = 0.5", 'uniform token axis = "Y"',
        "rel material:binding:physics = </Thing/steel>", at((0.0, 0.25, 0.0)), apis=("PhysicsCollisionAPI",
        "MaterialBindingAPI"))  # fmt: skip
    arm = prim("Xform", "arm", at((0.0, 0.0, 0.3)), rod, apis=("PhysicsRigidBodyAPI",))
    variant = f'variantSet "length" = {{\n"long" {{\n{arm}\n}}\n"short" {{\n}}\n}}'
    ball = joint("Spherical", "ball", ("/Thing/arm", "/Thing/shade"), 'uniform token physics:axis = "Y"',
        "float physics:coneAngle0Limit = 40\nfloat physics:coneAngle1Limit = 40", frame0="0 0.5 0")  # fmt: skip
    hinge = joint("Revolute", "elbow", ("/Thing/foot", "/Thing/arm"), limits(-20.0, 70.0, "X"), frame0="0 0 0.3")
    foot = body("foot", plate("mesh", (0.2, 0.2, 0.02)), mass=3.0, moments=(0.01, 0.01, 0.02))
    shade = body("shade", at((0.0, 0.5, 0.3)), plate("mesh", (0.1, 0.1, 0.1)), mass=0.2, moments=(1e-3, 1e-3, 1e-3))
    metadata = 'variants = {\nstring length = "long"\n}\nprepend variantSets = "length"'
    free: Numbers = {"type": "continuous"}
    cone: Numbers = {"type": "revolute", "lower": -40 * DEGREE, "upper": 40 * DEGREE}
    return Stage({"lamp.usda": usda(prim("Xform", "Thing", foot, shade, hinge, ball, steel, variant,
        more=metadata))}, {"elbow": {"type": "revolute", "lower": -20 * DEGREE, "upper": 70 * DEGREE},
        "ball_1": cone, "ball_2": cone, "ball": free}, {"foot": 3.0, "arm": 7800.0 * math.pi * 0.01**2 * 0.5,
        "shade": 0.2}, "foot", ("ball joint /Thing/ball is three hinges",
        "/Thing/arm states no inertia: that of its shapes is taken"), {"arm": (0.4, 0.3)})  # fmt: skip


def mujoco(*inside: str, scene: str = "") -> Mapping[str, str]:
    """One file in the manner of MuJoCo's and Newton's converters: bodies nested, each with its joint inside."""
    settings = prim("PhysicsScene", "scene", scene) if scene else ""
    return {"thing.usda": usda(prim("Xform", "Thing", prim("Scope", "Geometry", *inside), settings))}


def mujoco_chain() -> Stage:
    """Two hinges one below the other, with MuJoCo's own numbers; bodies without a joint of their own are welded."""
    first = joint("Revolute", "first", ("/Thing/Geometry/a", "/Thing/Geometry/a/b"), limits(-45.0, 45.0, "Z"),
        "double mjc:stiffness = 0.5", "double mjc:springref = 20", "double mjc:damping = 0.03",
        "double mjc:frictionloss = 0.02", "double mjc:armature = 0.001", frame0="0.1 0 0",
        apis=("MjcJointAPI",))  # fmt: skip
    second = joint("Revolute", "second", ("/Thing/Geometry/a/b", "/Thing/Geometry/a/b/c"), limits(0.0, 120.0, "X"),
        "float newton:damping = 0.01", "float newton:friction = 0.05", "float newton:armature = 0.002",
        frame0="0.2 0 0|0.5 0.5 0.5 0.5", frame1="0 0 0|0.5 0.5 0.5 0.5", apis=("NewtonJointAPI",))  # fmt: skip
    weld = joint("Fixed", "weld", ("/Thing/Geometry/a/b/c", "/Thing/Geometry/a/b/c/tip"), frame0="0.3 0 0")
    ball = prim("Capsule", "geom", "double radius = 0.01", "double height = 0.1", 'uniform token axis = "X"',
        apis=("PhysicsCollisionAPI",))  # fmt: skip
    tip = body("tip", at((0.3, 0.0, 0.0)), ball, weld, mass=0.1, moments=(1e-4, 2e-4, 2e-4))
    c = body("c", at((0.2, 0.0, 0.0)), plate("geom", (0.3, 0.02, 0.02)), tip, second, mass=0.3, moments=(1e-4, 2e-3,
        2e-3))  # fmt: skip
    b = body("b", at((0.1, 0.0, 0.0)), plate("geom", (0.2, 0.03, 0.03)), c, first, mass=0.4, moments=(1e-4, 1e-3, 1e-3))
    return Stage(mujoco(body("a", plate("geom", (0.2, 0.2, 0.1)), b, mass=5.0, moments=(0.02, 0.02, 0.03))),
        {"first": {"type": "revolute", "lower": -45 * DEGREE, "upper": 45 * DEGREE, "spring_stiffness": 0.5,
        "spring_reference": 20 * DEGREE, "damping": 0.03, "friction": 0.02, "armature": 0.001},
        "second": {"type": "revolute", "lower": 0.0, "upper": 120 * DEGREE, "damping": 0.01 / DEGREE,
        "friction": 0.05, "armature": 0.002}, "weld": {"type": "fixed"}}, {"a": 5.0, "b": 0.4, "c": 0.3, "tip": 0.1},
        "a")  # fmt: skip


def mujoco_slides() -> Stage:
    """Angles in radians, a reference that shifts limits and spring, and a follower by Newton's coefficients."""
    lift = joint("Prismatic", "lift", ("/Thing", "/Thing/Geometry/car"), limits(0.1, 0.5, "Z"),
        "double mjc:ref = 0.2", "double mjc:stiffness = 30", "double mjc:springref = 0.3", "double mjc:damping = 4",
        frame0="0 0 0.5")  # fmt: skip
    knob = joint("Revolute", "knob_turn", ("/Thing/Geometry/car", "/Thing/Geometry/car/knob"), limits(-90.0, 90.0,
        "Y"), "double mjc:stiffness = 0.2", "double mjc:springref = 0.7", frame0="0.1 0 0")  # fmt: skip
    needle = joint("Revolute", "needle_turn", ("/Thing/Geometry/car", "/Thing/Geometry/car/needle"), limits(-180.0,
        180.0, "Y"), "rel newton:mimicJoint = </Thing/Geometry/car/knob/knob_turn>", "float newton:mimicCoef0 = 9",
        "float newton:mimicCoef1 = 1.5", frame0="-0.1 0 0", apis=("NewtonMimicAPI",))  # fmt: skip
    parts = [body(name, at((x, 0.0, 0.0)), plate("geom", (0.03, 0.01, 0.03)), own, mass=0.02, moments=(1e-6, 1e-6,
        1e-6)) for name, x, own in (("knob", 0.1, knob), ("needle", -0.1, needle))]  # fmt: skip
    car = body("car", at((0.0, 0.0, 0.5)), plate("geom", (0.3, 0.3, 0.1)), *parts, lift, mass=2.0, moments=(0.1, 0.1,
        0.2))  # fmt: skip
    return Stage(mujoco(car, scene='uniform token mjc:compiler:angle = "radian"'), {"lift": {"type": "prismatic",
        "lower": -0.1, "upper": 0.3, "spring_stiffness": 30.0, "spring_reference": 0.1, "damping": 4.0},
        "knob_turn": {"type": "revolute", "lower": -math.pi / 2, "upper": math.pi / 2, "spring_stiffness": 0.2,
        "spring_reference": 0.7}, "needle_turn": {"type": "revolute", "lower": -math.pi, "upper": math.pi,
        "mimic": "knob_turn", "multiplier": 1.5, "offset": 9 * DEGREE}}, {"car": 2.0, "knob": 0.02, "needle": 0.02},
        "base")  # fmt: skip


def newton_cart() -> Stage:
    """A cart that slides in x and turns about z by one joint of limits alone; a mirrored part; bodies of one name."""
    locked = [f"float limit:{name}:physics:low = 1\nfloat limit:{name}:physics:high = -1" for name in ("transY",
        "transZ", "rotX", "rotY")]  # fmt: skip
    drive_ = joint("", "move", ("", "/Thing/Geometry/cart"), *locked, "float limit:transX:physics:low = -1",
        "float limit:transX:physics:high = 1", frame0="0 0 0.1")  # fmt: skip
    mirrored = plate("left", (0.2, 0.05, 0.05), place=at((0.1, 0.1, 0.0), scale=(-1, 1, 2)))
    wheel = body("cart", at((0.1, 0.0, 0.0)), prim("Cone", "geom", "double radius = 0.05", "double height = 0.1",
        'uniform token axis = "X"', apis=("PhysicsCollisionAPI",)), mass=0.1, moments=(1e-4, 1e-4,
        1e-4))  # fmt: skip
    spin = joint("Revolute", "spin", ("/Thing/Geometry/cart", "/Thing/Geometry/cart/cart"), limits(-math.inf,
        math.inf, "X"), frame0="0.1 0 0")  # fmt: skip
    return Stage(mujoco(body("cart", at((0.0, 0.0, 0.1)), mirrored, wheel, mass=1.0, moments=(0.01, 0.02, 0.03)),
        drive_, spin), {"move_1": {"type": "prismatic", "lower": -1.0, "upper": 1.0}, "move": {"type": "continuous"},
        "spin": {"type": "continuous"}}, {"cart": 1.0, "cart_cart": 0.1}, "base")  # fmt: skip


def newton_doors() -> Stage:
    """Y up in feet: two doors on a frame that is held, one joined from its own side, one with limits in a sublayer."""
    frame = body("frame", plate("geom", (3.0, 7.0, 0.3)), mass=40.0, com=(0.0, -0.1, 0.0), moments=(90.0, 30.0, 80.0))
    doors = [body(name, at((x, 0.0, 0.2)), plate("geom", (1.4, 6.5, 0.1)), mass=8.0, com=(0.2 * sign, 0.0, 0.0),
        moments=(20.0, 1.5, 21.0)) for name, x, sign in (("left", -0.75, 1.0), ("right", 0.75, -1.0))]  # fmt: skip
    held = joint("Fixed", "held", ("/Thing", "/Thing/Geometry/frame"))
    left = joint("Revolute", "left_hinge", ("/Thing/Geometry/left", "/Thing/Geometry/frame"), limits(0.0, 100.0,
        "Y"), "float newton:friction = 2.0", frame0="-0.7 0 0", frame1="-1.45 0 0.2",
        apis=("NewtonJointAPI",))  # fmt: skip
    right = joint("Revolute", "right_hinge", ("/Thing/Geometry/frame", "/Thing/Geometry/right"), frame0="1.45 0 0.2",
        frame1="0.7 0 0")  # fmt: skip
    over = f'over "Thing" {{\nover "right_hinge" {{\n{limits(-100.0, 0.0, "Y")}\n}}\n}}'
    thing = prim("Xform", "Thing", prim("Scope", "Geometry", frame, *doors), held, left, right)
    text = usda(thing, up="Y", metres=0.3048).replace("defaultPrim", "subLayers = [@./limits.usda@]\ndefaultPrim")
    opened: Numbers = {"type": "revolute", "lower": -100 * DEGREE, "upper": 0.0}
    return Stage({"doors.usda": text, "limits.usda": usda(over)}, {"left_hinge": {"type": "revolute", "lower": 0.0,
        "upper": 100 * DEGREE, "friction": 2.0 * 0.3048**2}, "right_hinge": opened}, {"frame": 40.0, "left": 8.0,
        "right": 8.0}, "frame", ("link 'frame' is fixed to the world",))  # fmt: skip


STAGES = {
    maker.__name__: maker()
    for maker in (
        isaac_cabinet, isaac_gripper, isaac_pendulum, simready_oven, simready_bin, simready_lamp, mujoco_chain,
        mujoco_slides, newton_cart, newton_doors,
    )
}  # fmt: skip
