"""One object of a pack for Isaac Lab (``asset2sim pack OUT --for isaaclab --out PACK``) in a scene: it stands on the
ground in its initial state for a second.

    ./isaaclab.sh -p examples/isaaclab_scene.py PACK NAME
"""

import sys

from isaaclab.app import AppLauncher

app = AppLauncher(headless=True).app

import isaaclab.sim as sim_utils  # noqa: E402
from isaaclab.assets import Articulation  # noqa: E402

pack, name = sys.argv[1:]
sys.path.insert(0, pack)

from refined_objects import CONFIGS  # noqa: E402

simulation = sim_utils.SimulationContext(sim_utils.SimulationCfg(dt=1.0 / 240.0))
sim_utils.GroundPlaneCfg().func("/World/Ground", sim_utils.GroundPlaneCfg())
thing = Articulation(CONFIGS[name].replace(prim_path="/World/Object"))
simulation.reset()
start = thing.data.joint_pos[0].clone()
for _ in range(240):
    simulation.step()
    thing.update(simulation.get_physics_dt())
print(f"{name}: joints moved by at most {(thing.data.joint_pos[0] - start).abs().max():.2g} rad or m in a second")
app.close()
