"""Pack for ManiSkill: a module that adds an object to a task's scene, with its state and springs as in SAPIEN."""

from asset2sim.packs.declared_pack import Pack

PACK = Pack(
    name="maniskill",
    title="ManiSkill",
    contents="`refined_objects.py`: `add(self.scene, name)` in a task's `_load_scene`, `reset(items)` in its "
    "`_initialize_episode`. For the CPU backend.",
    opens="python -c 'import refined_objects; print(refined_objects.NAMES)'",
    opened_by="SAPIEN 3, whose scenes ManiSkill's hold; a stand-in of their `sub_scenes`, not ManiSkill itself",
)
