"""Two refined objects and a robot in one MuJoCo model, then the first object in every engine that is named: a joint is
put at 30 % of its way, pushed, its velocity read, led back by a servo, and reset.

python examples/one_api.py OUT/assets/table_two_drawers OUT/assets/laptop_silver mujoco pybullet sapien
"""

import sys

from asset2sim.load import Loaded, load

STEPS, PUSH = 24, 20.0  # of 1/240 s: 0.1 s; rad/s² or m/s² over what friction and weight take
ROBOT = """<mujoco><worldbody><body name="upper" pos="0 0 0.4">
<joint name="shoulder" axis="0 1 0" damping="1"/><geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/>
<body name="lower" pos="0.3 0 0"><joint name="elbow" axis="0 1 0" damping="1"/>
<geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.03"/></body></body></worldbody></mujoco>"""


def use(item: Loaded) -> None:
    """Push the joint that friction holds most, wherever the object is."""
    joint = max(item.about.joints, key=lambda one: one.friction)
    item.reset({joint.name: 0.3})
    start = item.positions()[joint.name]
    opens = 1.0 if joint.open > joint.closed else -1.0
    push = joint.friction + abs(joint.gravity_load) + PUSH * (joint.effective_inertia + joint.armature)  # N·m or N
    item.apply_effort({joint.name: opens * push})
    for _ in range(STEPS):
        item.step()
    moved, speed = item.positions()[joint.name] - start, item.velocities()[joint.name]
    item.apply_effort({joint.name: 0.0})
    item.set_targets({joint.name: start})
    for _ in range(10 * STEPS):
        item.step()
    led = item.positions()[joint.name]
    item.reset()
    again = item.positions()[joint.name]
    print(f"{item.engine} {joint.name} from {start:.4f} by {moved:.4f} at {speed:.4f}, led to {led:.4f}, ", end="")
    print(f"reset to {again:.4f} {joint.unit}; {item.about.verdict}")


def in_one_model(first: str, second: str) -> Loaded:
    """Two objects and a robot compiled together; the first of them."""
    import mujoco

    world = mujoco.MjSpec()
    world.option.timestep, world.option.impratio = 1.0 / 240.0, 100.0
    world.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    world.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    world.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 0.05))
    world.attach(
        mujoco.MjSpec.from_string(ROBOT), prefix="robot/", frame=world.worldbody.add_frame(pos=(-2.0, 0.0, 0.0))
    )
    items = [load(one, "mujoco", into=world, position=(0.0, 1.5 * at)) for at, one in enumerate((first, second))]
    model = world.compile()
    data = mujoco.MjData(model)
    for item in items:
        item.finish(model, data)
    print(f"one model: {', '.join(item.name for item in items)} and a robot, {model.nv} degrees of freedom")
    return items[0]


if __name__ == "__main__":
    for engine in sys.argv[3:]:
        use(in_one_model(*sys.argv[1:3]) if engine == "mujoco" else load(sys.argv[1], engine))
