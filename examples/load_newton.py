"""A refined object in Newton: `item.model`, `item.solver`, `item.states` and `item.control`.

python examples/load_newton.py data/refined/assets/laptop_silver
"""

import sys

from asset2sim.load import load

item = load(sys.argv[1], engine="newton")
print(item.about)
joint = max(item.about.joints, key=lambda one: one.friction)
push = 3.0 * (joint.friction + abs(joint.gravity_load))  # N·m or N
middle = 0.0 if joint.lower is None or joint.upper is None else 0.5 * (joint.lower + joint.upper)
push *= 1.0 if joint.initial_position < middle else -1.0
labels = [str(label).rpartition("/")[2] for label in item.builder.joint_label]
forces = item.control.joint_f.numpy()
forces[item.builder.joint_qd_start[labels.index(joint.name)]] = push
item.control.joint_f.assign(forces)
for _ in range(120):
    item.step()
moved = f"from {joint.initial_position:.3f} to {item.positions()[joint.name]:.3f} {joint.unit}"
print(f"pushed by {push:.3g}: {joint.name} {moved}")
