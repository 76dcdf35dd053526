"""A refined object in SAPIEN: `item.scene` and `item.articulation`.

python examples/load_sapien.py data/refined/assets/laptop_silver
"""

import sys

import numpy as np

from asset2sim.load import load

item = load(sys.argv[1], engine="sapien")
print(item.about)
joint = max(item.about.joints, key=lambda one: one.friction)
push = 3.0 * (joint.friction + abs(joint.gravity_load))  # N·m or N
middle = 0.0 if joint.lower is None or joint.upper is None else 0.5 * (joint.lower + joint.upper)
push *= 1.0 if joint.initial_position < middle else -1.0
pushes = [push if other.name == joint.name else 0.0 for other in item.articulation.active_joints]
for _ in range(120):
    item.articulation.set_qf(np.array(pushes, np.float32))
    item.scene.step()
moved = f"from {joint.initial_position:.3f} to {item.positions()[joint.name]:.3f} {joint.unit}"
print(f"pushed by {push:.3g}: {joint.name} {moved}")
