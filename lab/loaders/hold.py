"""How far the joints that must hold move in three seconds, in an engine that is not installed beside us: each object as
the engine's own URDF loader leaves it, the same put into its state by hand, and through ``load.py``. It needs that file
and the engine alone, so that any Python runs it which has them: ``python hold.py LOAD_PY ENGINE FOLDER …`` prints a
line of JSON an object."""

import json
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

HOLD_S = 3.0
TURN_RAD, SLIDE_M = 1e-2, 1e-3
"""How far a hinge and a slider that hold may move."""


class Plain(NamedTuple):
    """An object as an engine's URDF loader leaves it on a floor: read and put positions by name, step, time step."""

    read: Callable[[], Mapping[str, float]]
    put: Callable[[Mapping[str, float]], object]
    step: Callable[[], object]
    timestep_s: float


Moving = tuple[Callable[[], Mapping[str, float]], Callable[[], object], float]
"""How an object's positions are read by name, how it is stepped, and its time step, s."""


def main(loader: Path, engine: str, folders: list[Path]) -> None:
    """Measure every folder."""
    module = loader_module(loader)
    for folder in folders:
        about = module.describe(folder)
        said = answers(
            about,
            as_loaded=lambda about=about: plainly(engine, about, put=False),  # type: ignore[misc]
            put=lambda about=about: plainly(engine, about, put=True),  # type: ignore[misc]
            load=lambda folder=folder: through(module, engine, folder),  # type: ignore[misc]
        )
        sys.stdout.write("HELD " + json.dumps(said) + "\n")
        sys.stdout.flush()


def answers(about: Any, **ways: Callable[[], Moving]) -> dict[str, Any]:
    """By each way the largest share of its bound by which a joint that holds is off the asked state within the time;
    ``problem``: what an engine says that loads nothing."""
    said: dict[str, Any] = {"asset": about.folder.name}
    for name, way in ways.items():
        try:
            said[name] = worst(about, *way())
        except Exception as error:  # whatever an engine raises is its answer
            said[name] = None
            said["problem"] = f"{name}: {type(error).__name__}: {' '.join(str(error).split())[:200]}"
    return said


def loader_module(path: Path) -> ModuleType:
    """The loader, from its file."""
    spec = spec_from_file_location("asset2sim_load_file", path)
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def through(module: ModuleType, engine: str, folder: Path) -> Moving:
    """The object through ``load``."""
    item = module.load(folder, engine)
    return item.positions, item.step, 1.0 / 240.0


def plainly(engine: str, about: Any, *, put: bool) -> Moving:
    """The object as its URDF, put into its state by hand or left as it was loaded."""
    about = replace(about, urdf=deepcopy(about.urdf))
    with tempfile.TemporaryDirectory() as place:
        plain = PLAIN[engine](about, str(without_visuals(about, Path(place))))
        if put:
            plain.put({joint.name: joint.initial_position for joint in about.joints})
    return plain.read, plain.step, plain.timestep_s


def worst(about: Any, read: Any, step: Any, timestep_s: float) -> float:
    """The largest deviation of a joint that holds from the asked state over the time, as a share of its bound."""
    held = [joint for joint in about.joints if joint.holds]
    share, steps = 0.0, round(HOLD_S / timestep_s)
    for count in range(steps + 1):
        if count % 10 == 0 or count == steps:
            found = read()
            off = [abs(found[j.name] - j.initial_position) / (SLIDE_M if j.unit == "m" else TURN_RAD) for j in held]
            share = max([share, *off])
        if count < steps:
            step()
    return share


def without_visuals(about: Any, place: Path) -> Path:
    """A copy of the URDF with absolute paths and nothing that needs a graphics device or repeats a name."""
    for link in about.urdf.findall("link"):
        link[:] = [element for element in link if element.tag != "visual"]
        for collision in link.findall("collision"):
            collision.attrib.pop("name", None)
    path = place / "mobility.urdf"
    ET.ElementTree(about.urdf).write(path, encoding="utf-8")
    return path


def drake(about: Any, urdf: str) -> Plain:
    """``Parser(plant).AddModels(path)``, the root free on a floor."""
    import pydrake.all as engine

    builder = engine.DiagramBuilder()
    plant, _ = engine.AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    floor, below = engine.Box(20.0, 20.0, 1.0), engine.RigidTransform([0.0, 0.0, -0.5])
    plant.RegisterCollisionGeometry(plant.world_body(), below, floor, "floor", engine.CoulombFriction(0.5, 0.5))
    (instance,) = engine.Parser(plant).AddModels(urdf)
    root = plant.GetBodyByName(about.root, instance)
    plant.SetDefaultFloatingBaseBodyPose(root, engine.RigidTransform([0.0, 0.0, about.height_m]))
    plant.Finalize()
    simulator = engine.Simulator(builder.Build())
    context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
    joints = {joint.name: plant.GetJointByName(joint.name, instance) for joint in about.joints}

    def put(state: Mapping[str, float]) -> None:
        values = plant.GetPositions(context)
        for name, value in state.items():
            values[joints[name].position_start()] = value
        plant.SetPositions(context, values)

    return Plain(
        lambda: {name: joint.GetOnePosition(context) for name, joint in joints.items()},
        put,
        lambda: simulator.AdvanceTo((round(context.get_time() / 1e-3) + 1) * 1e-3),
        1e-3,
    )


def genesis(about: Any, urdf: str) -> Plain:
    """``gs.morphs.URDF(file=path)``, the root free on a plane."""
    import genesis as engine

    with suppress(engine.GenesisException):  # it is initialised already
        engine.init(backend=engine.cpu, logging_level="error")
    scene = engine.Scene(show_viewer=False)
    scene.add_entity(engine.morphs.Plane())
    entity = scene.add_entity(engine.morphs.URDF(file=urdf, pos=(0.0, 0.0, about.height_m)))
    scene.build()
    dofs = {joint.name: entity.get_joint(joint.name).dofs_idx_local for joint in about.joints}

    def put(state: Mapping[str, float]) -> None:
        for name, value in state.items():
            entity.set_dofs_position([value], dofs[name])

    return Plain(
        lambda: {name: float(entity.get_dofs_position(index)) for name, index in dofs.items()},
        put,
        scene.step,
        float(scene.dt),
    )


def newton(about: Any, urdf: str) -> Plain:
    """``builder.add_urdf(path, floating=True)`` in the MuJoCo solver, on a plane."""
    import newton as engine

    builder = engine.ModelBuilder()
    engine.solvers.SolverMuJoCo.register_custom_attributes(builder)
    import warp

    builder.add_urdf(urdf, xform=warp.transform((0.0, 0.0, about.height_m), warp.quat_identity()), floating=True)
    builder.add_ground_plane()
    model = builder.finalize()
    solver = engine.solvers.SolverMuJoCo(model, use_mujoco_cpu=not model.device.is_cuda)
    states, control = [model.state(), model.state()], model.control()
    labels = [str(label).rpartition("/")[2] for label in builder.joint_label]
    places = {joint.name: int(builder.joint_q_start[labels.index(joint.name)]) for joint in about.joints}

    def put(state: Mapping[str, float]) -> None:
        values = states[0].joint_q.numpy()
        for name, value in state.items():
            values[places[name]] = value
        states[0].joint_q.assign(values)

    def read() -> Mapping[str, float]:
        values = states[0].joint_q.numpy()
        return {name: float(values[place]) for name, place in places.items()}

    def step() -> None:
        solver.step(states[0], states[1], control, None, 1.0 / 240.0)
        states.reverse()

    return Plain(read, put, step, 1.0 / 240.0)


PLAIN = {"drake": drake, "genesis": genesis, "newton": newton}
"""Engine → its own URDF loader."""

if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], [Path(folder) for folder in sys.argv[3:]])
