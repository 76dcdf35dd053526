"""A refined object in PyBullet: `item.client` and `item.body` are what its functions take.

python examples/load_pybullet.py data/refined/assets/laptop_silver
"""

import sys

import pybullet

from asset2sim.load import load

item = load(sys.argv[1], engine="pybullet")
print(item.about)
joint = max(item.about.joints, key=lambda one: one.friction)
push = 3.0 * (joint.friction + abs(joint.gravity_load))  # N·m or N
middle = 0.0 if joint.lower is None or joint.upper is None else 0.5 * (joint.lower + joint.upper)
push *= 1.0 if joint.initial_position < middle else -1.0
for _ in range(120):
    index, effort = item.joints[joint.name], pybullet.TORQUE_CONTROL
    pybullet.setJointMotorControl2(item.body, index, effort, force=push, physicsClientId=item.client)
    item.step()  # or item.drive(), for the springs, and pybullet.stepSimulation()
moved = f"from {joint.initial_position:.3f} to {item.positions()[joint.name]:.3f} {joint.unit}"
print(f"pushed by {push:.3g}: {joint.name} {moved}")
