"""A refined object in MuJoCo: `item.model` and `item.data`.

python examples/load_mujoco.py data/refined/assets/laptop_silver
"""

import sys

import mujoco

from asset2sim.load import load

item = load(sys.argv[1], engine="mujoco")
print(item.about)
joint = max(item.about.joints, key=lambda one: one.friction)
push = 3.0 * (joint.friction + abs(joint.gravity_load))  # N·m or N
middle = 0.0 if joint.lower is None or joint.upper is None else 0.5 * (joint.lower + joint.upper)
push *= 1.0 if joint.initial_position < middle else -1.0
item.data.joint(joint.name).qfrc_applied[0] = push
mujoco.mj_step(item.model, item.data, nstep=120)
moved = f"from {joint.initial_position:.3f} to {item.positions()[joint.name]:.3f} {joint.unit}"
print(f"pushed by {push:.3g}: {joint.name} {moved}")
