"""A refined object in an Isaac Lab scene, from ``mobility.usda`` (``--export usd``), which holds friction, damping,
springs, armature and the support. A scene must state the initial state; ``describe`` has it, and the height to stand.

    ./isaaclab.sh -p examples/isaaclab_scene.py data/refined/assets/laptop_silver
"""

import sys
from pathlib import Path

from isaaclab.app import AppLauncher

app = AppLauncher(headless=True).app

import isaaclab.sim as sim_utils  # noqa: E402
from isaaclab.actuators import ImplicitActuatorCfg  # noqa: E402
from isaaclab.assets import Articulation, ArticulationCfg  # noqa: E402

from asset2sim.load import describe  # noqa: E402

folder = Path(sys.argv[1])
about = describe(folder)
object_cfg = ArticulationCfg(
    prim_path="/World/Object",
    spawn=sim_utils.UsdFileCfg(usd_path=str(folder / "mobility.usda")),
    init_state=ArticulationCfg.InitialStateCfg(
        pos=(0.0, 0.0, about.height_m), joint_pos={joint.name: joint.initial_position for joint in about.joints}
    ),
    # None for stiffness, damping and the rest: those of the USD.
    actuators={"all": ImplicitActuatorCfg(joint_names_expr=[".*"], stiffness=None, damping=None)},
)

simulation = sim_utils.SimulationContext(sim_utils.SimulationCfg(dt=1.0 / 240.0))
sim_utils.GroundPlaneCfg().func("/World/Ground", sim_utils.GroundPlaneCfg())
thing = Articulation(object_cfg)
simulation.reset()
for _ in range(720):
    simulation.step()
    thing.update(simulation.get_physics_dt())
print(dict(zip(thing.joint_names, thing.data.joint_pos[0].tolist(), strict=True)))
app.close()
