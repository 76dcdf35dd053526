"""Every object of a pack for MuJoCo (``asset2sim pack OUT --for mujoco --out PACK``): put into its initial state, and
what moved of it after a second.

    python examples/mujoco_pack.py PACK
"""

import sys
from pathlib import Path

import mujoco
import numpy as np

for scene in sorted(Path(sys.argv[1]).glob("objects/*/scene.xml")):
    model = mujoco.MjModel.from_xml_path(str(scene))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    start = data.qpos.copy()
    while data.time < 1.0:
        mujoco.mj_step(model, data)
    print(f"{scene.parent.name}: moved by at most {np.abs(data.qpos - start).max():.2g} rad or m in a second")
