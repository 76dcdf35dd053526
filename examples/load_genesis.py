"""A refined object in Genesis: `item.scene` and `item.entity`.

python examples/load_genesis.py data/refined/assets/laptop_silver
"""

import sys

from asset2sim.load import load

item = load(sys.argv[1], engine="genesis")
print(item.about)
joint = max(item.about.joints, key=lambda one: one.friction)
push = 3.0 * (joint.friction + abs(joint.gravity_load))  # N·m or N
middle = 0.0 if joint.lower is None or joint.upper is None else 0.5 * (joint.lower + joint.upper)
push *= 1.0 if joint.initial_position < middle else -1.0
dofs = item.entity.get_joint(joint.name).dofs_idx_local
for _ in range(120):
    item.entity.control_dofs_force([push], dofs)
    item.scene.step()
moved = f"from {joint.initial_position:.3f} to {item.positions()[joint.name]:.3f} {joint.unit}"
print(f"pushed by {push:.3g}: {joint.name} {moved}")
