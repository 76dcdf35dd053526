"""Pack for MuJoCo, laid out as MuJoCo Menagerie has its models: ``scene.xml`` beside the object, a README each."""

from asset2sim.packs.declared_pack import Pack
from schemas.vocabulary import Export

PACK = Pack(
    name="mujoco",
    title="MuJoCo",
    contents="A folder an object, as in MuJoCo Menagerie: `scene.xml` is the object on a floor, `mobility.xml` the "
    "object alone; the keyframe `home` is its initial state.",
    opens="python -m mujoco.viewer --mjcf=objects/NAME/scene.xml",
    exports=(Export.MJCF,),
    opened_by="MuJoCo 4: compiled, reset to `home`, stepped until it has rested for a second",
)
