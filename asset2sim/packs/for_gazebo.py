"""Pack for Gazebo: a model folder an object (``model.config``, ``model.sdf``), and a world with all of them."""

from asset2sim.packs.declared_pack import Pack
from schemas.vocabulary import Export

PACK = Pack(
    name="gazebo",
    title="Gazebo",
    contents="A model an object (`model://NAME`) and `world.sdf` with all of them, for Gazebo Fortress and later. The "
    "joints' zero is the initial state.",
    opens="GZ_SIM_RESOURCE_PATH=$PWD/objects gz sim world.sdf",
    exports=(Export.SDF,),
    opened_by="libsdformat as Drake has it, where Drake is installed; else our own reader of SDF",
)
