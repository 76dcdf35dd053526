"""Pack for Isaac Lab: a module of ``ArticulationCfg``, an object's USD behind each."""

from asset2sim.packs.declared_pack import Pack
from schemas.vocabulary import Export

PACK = Pack(
    name="isaaclab",
    title="Isaac Lab",
    contents="`refined_objects.py` has an `ArticulationCfg` an object (`CONFIGS[name]`), which spawns its USD in its "
    "initial state; put the folder where your project imports from.",
    opens="./isaaclab.sh -p YOUR_SCRIPT.py  # from refined_objects import CONFIGS",
    exports=(Export.USD,),
    opened_by="usd-core (every prim and reference resolved); the module against the arguments that Isaac Lab documents",
)
