"""Every model of a pack for Gazebo or ROS 2 (``asset2sim pack OUT --for gazebo --out PACK``), opened by libsdformat,
Gazebo's parser, as Drake has it (``pip install drake``).

    python examples/gazebo_model.py PACK
"""

import sys
from pathlib import Path

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

for file in sorted(Path(sys.argv[1]).glob("objects/*/model.sdf")):
    plant = MultibodyPlant(0.001)
    (model,) = Parser(plant).AddModels(str(file))
    plant.Finalize()
    mass = sum(plant.get_body(body).default_mass() for body in plant.GetBodyIndices(model))
    print(f"{file.parent.name}: {mass:.6g} kg, {len(plant.GetJointIndices(model))} joints, "
          f"{plant.num_velocities(model)} degrees of freedom")  # fmt: skip
