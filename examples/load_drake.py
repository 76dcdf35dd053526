"""A refined object in Drake: `item.plant`, `item.diagram` and `item.simulator`.

python examples/load_drake.py data/refined/assets/laptop_silver
"""

import sys

import numpy as np

from asset2sim.load import load

item = load(sys.argv[1], engine="drake")
print(item.about)
joint = max(item.about.joints, key=lambda one: one.friction)
push = 3.0 * (joint.friction + abs(joint.gravity_load))  # N·m or N
middle = 0.0 if joint.lower is None or joint.upper is None else 0.5 * (joint.lower + joint.upper)
push *= 1.0 if joint.initial_position < middle else -1.0
forces = np.zeros(item.plant.num_velocities())
forces[item.plant.GetJointByName(joint.name, item.instance).velocity_start()] = push
context = item.plant.GetMyMutableContextFromRoot(item.simulator.get_mutable_context())
item.plant.get_applied_generalized_force_input_port().FixValue(context, forces)
item.simulator.AdvanceTo(0.5)
moved = f"from {joint.initial_position:.3f} to {item.positions()[joint.name]:.3f} {joint.unit}"
print(f"pushed by {push:.3g}: {joint.name} {moved}")
