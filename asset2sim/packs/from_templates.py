"""Packs that templates and exports alone make: Gazebo, Isaac Lab, LeRobot, ManiSkill, MuJoCo Menagerie's layout."""

from asset2sim.packs.declared_pack import Pack
from schemas.vocabulary import Export

PACKS = (
    Pack(
        name="gazebo",
        title="Gazebo",
        contents="A model an object (`model://NAME`) and `world.sdf` with all of them, for Gazebo Fortress and later. "
        "The joints' zero is the initial state.",
        opens="GZ_SIM_RESOURCE_PATH=$PWD/objects gz sim world.sdf",
        exports=(Export.SDF,),
    ),
    Pack(
        name="isaaclab",
        title="Isaac Lab",
        contents="`refined_objects.py` has an `ArticulationCfg` an object (`CONFIGS[name]`), which spawns its USD in "
        "its initial state; put the folder where your project imports from.",
        opens="./isaaclab.sh -p YOUR_SCRIPT.py  # from refined_objects import CONFIGS",
        exports=(Export.USD,),
    ),
    Pack(
        name="lerobot",
        title="LeRobot's EnvHub",
        contents="A repository for the Hub: `env.py` has `make_env(n_envs, use_async_envs)`, and `requirements.txt` "
        "pins what it runs on. Pin the commit where you use it.",
        opens="pip install -r requirements.txt && python -c 'import env; print(env.make_env(2).reset()[0].shape)'",
        exports=(Export.MJCF,),
    ),
    Pack(
        name="maniskill",
        title="ManiSkill",
        contents="`refined_objects.py`: `add(self.scene, name)` in a task's `_load_scene`, `reset(items)` in its "
        "`_initialize_episode`. For the CPU backend.",
        opens="python -c 'import refined_objects; print(refined_objects.NAMES)'",
    ),
    Pack(
        name="mujoco",
        title="MuJoCo",
        contents="A folder an object, as in MuJoCo Menagerie: `scene.xml` is the object on a floor, `mobility.xml` the "
        "object alone; the keyframe `home` is its initial state.",
        opens="python -m mujoco.viewer --mjcf=objects/NAME/scene.xml",
        exports=(Export.MJCF,),
    ),
)
