"""Pack for LeRobot's EnvHub: ``env.py`` with ``make_env``, a repository that ``lerobot.envs.make_env`` takes."""

from asset2sim.packs.declared_pack import Pack
from schemas.vocabulary import Export

PACK = Pack(
    name="lerobot",
    title="LeRobot's EnvHub",
    contents="A repository for the Hub: `env.py` has `make_env(n_envs, use_async_envs)`, and `requirements.txt` pins "
    "what it runs on. Pin the commit where you use it.",
    opens="pip install -r requirements.txt && python -c 'import env; print(env.make_env(2).reset()[0].shape)'",
    exports=(Export.MJCF,),
    opened_by="Gymnasium: `make_env` called as LeRobot calls it, reset and stepped; not LeRobot itself",
)
