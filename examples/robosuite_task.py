"""A refined object in robosuite, from a pack (``asset2sim pack OUT --for robosuite --out PACK``): it stands
beside an arm on the floor, in its initial state, for a second.

    python examples/robosuite_task.py PACK NAME
"""

import sys

import numpy as np
from robosuite.models.arenas import EmptyArena
from robosuite.models.robots import Panda
from robosuite.models.tasks import ManipulationTask
from robosuite.utils.binding_utils import MjSim

pack, name = sys.argv[1:]
sys.path.insert(0, pack)

from refined_objects import STATES, RefinedObject  # noqa: E402

item = RefinedObject(name)
item.stand_on(0.0, x_m=1.5)
task = ManipulationTask(mujoco_arena=EmptyArena(), mujoco_robots=[Panda()], mujoco_objects=[item])
item.complete(task)
simulation = MjSim.from_xml_string(task.get_xml())
item.reset(simulation)
for _ in range(round(1.0 / simulation.model.opt.timestep)):
    simulation.step()
moved = [position - STATES[name][joint] for joint, position in item.positions(simulation).items()]
print(f"{name}: joints moved by at most {np.abs(moved).max():.2g} rad or m in a second")
