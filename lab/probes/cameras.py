"""The DROID set-up's three cameras, and their pictures of a stage, drawn by MuJoCo through EGL or OSMesa."""

import os
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from asset2sim.gym.arm.franka import HAND
from asset2sim.gym.world import TOOL
from asset2sim.physics.arrays import Array
from asset2sim.render.camera import camera_axes
from lab.probes.observation import Picture
from lab.probes.visual_model import looks_of
from lab.trials.scene import TrialScene
from schemas.errors import UsageError

WIDTH, HEIGHT = 320, 180
"""Of a picture, pixels: what DROID's data set keeps of its cameras' 1280 × 720."""


@dataclass(frozen=True)
class DroidCamera:
    """A camera: ``at``, m, where it looks ``to``, which way is ``up``, in the frame of the arm's base or, for the
    wrist's, of its hand (z to the finger tips, y along which they move); its vertical field of view, degrees."""

    name: str
    at: tuple[float, float, float]
    to: tuple[float, float, float]
    up: tuple[float, float, float]
    vertical_deg: float
    on_hand: bool = False


CAMERAS = (
    DroidCamera("exterior_left", (0.05, 0.57, 0.66), (0.65, 0.10, 0.08), (0.0, 0.0, 1.0), 71.5),
    DroidCamera("exterior_right", (0.05, -0.57, 0.66), (0.65, -0.10, 0.08), (0.0, 0.0, 1.0), 71.5),
    DroidCamera("wrist", (0.074, -0.031, 0.011), (0.024, -0.032, 0.163), (1.0, 0.0, 0.0), 56.7, on_hand=True),
)
"""Two ZED 2 beside the arm and a ZED Mini at its wrist. DROID's operators place the outside cameras as they like; these
stand where the public simulation of DROID for openpi's policies (arhanjain/sim-evals) has them, with its fields of
view (focal lengths of 2.1 and 2.8 mm over 3.024 mm). The wrist's, too: beside the gripper, its lens 31 mm off the
middle as the left one of a stereo camera is, tilted by 18° towards the finger tips."""


class Cameras:
    """Draws a stage with the refined object in ``folder`` from the cameras. A context manager: it holds an OpenGL
    context. Raises UsageError where none can be had."""

    def __init__(self, folder: Path, stage: TrialScene, width: int = WIDTH, height: int = HEIGHT) -> None:
        self.stage, self.width, self.height = stage, width, height
        spec = looks_of(folder, stage, width, height)
        for camera in CAMERAS:
            body = spec.body(TOOL + HAND) if camera.on_hand else spec.worldbody
            axes = looking(camera)
            turned = np.zeros(4)
            mujoco.mju_mat2Quat(turned, axes.ravel())
            body.add_camera(name=camera.name, pos=camera.at, quat=turned, fovy=camera.vertical_deg)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.bodies = [
            (int(stage.model.body(name).id), int(self.model.body(name).mocapid[0]))
            for name in (self.model.body(index).name for index in range(1, self.model.nbody))
        ]
        self.turn = stage.base[:3, :3].T
        self.gl = open_gl(width, height)
        self.context = mujoco.MjrContext(self.model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self.context)
        self.scene, self.options = mujoco.MjvScene(self.model, maxgeom=4000), mujoco.MjvOption()
        self.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        self.rect = mujoco.MjrRect(0, 0, width, height)
        self.eye = mujoco.MjvCamera()
        self.eye.type = mujoco.mjtCamera.mjCAMERA_FIXED

    def __enter__(self) -> "Cameras":
        return self

    def __exit__(self, *_: object) -> None:
        self.gl.make_current()
        self.context.free()
        self.gl.free()

    def follow(self) -> None:
        """Take over where everything is in the stage."""
        data = self.stage.data
        for body, mocap in self.bodies:
            self.data.mocap_pos[mocap] = self.turn @ (data.xpos[body] - self.stage.base[:3, 3])
            mujoco.mju_mat2Quat(self.data.mocap_quat[mocap], (self.turn @ data.xmat[body].reshape(3, 3)).ravel())
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def picture(self, name: str) -> Picture:
        """(height, width, 3) what a camera sees, as of the last ``follow``."""
        self.gl.make_current()
        self.eye.fixedcamid = int(self.model.camera(name).id)
        mujoco.mjv_updateScene(
            self.model, self.data, self.options, None, self.eye, mujoco.mjtCatBit.mjCAT_ALL, self.scene
        )
        mujoco.mjr_render(self.rect, self.scene, self.context)
        found = np.empty((self.height, self.width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(found, None, self.rect, self.context)
        return np.ascontiguousarray(found[::-1])


def looking(camera: DroidCamera) -> Array:
    """(3, 3) axes of a camera, which looks along its -z with y upwards, as columns."""
    back = np.array(camera.at) - np.array(camera.to)
    return camera_axes(back / np.linalg.norm(back), np.array(camera.up)).T


def open_gl(width: int, height: int) -> Any:
    """A current OpenGL context without a window: of ``MUJOCO_GL`` where that is egl or osmesa, else the first that
    works. Raises UsageError where none does."""
    asked = os.environ.get("MUJOCO_GL", "").lower()
    for name in [asked] if asked in ("egl", "osmesa") else ["egl", "osmesa"]:
        before = os.environ.get("PYOPENGL_PLATFORM")
        try:
            found = import_module(f"mujoco.{name}").GLContext(width, height)
            found.make_current()
        except Exception:  # a missing library shows as an ImportError, AttributeError or an error of OpenGL's
            if before is None:
                os.environ.pop("PYOPENGL_PLATFORM", None)
            continue
        return found
    raise UsageError(
        "pictures need OpenGL without a screen, and neither EGL nor OSMesa works here; on Debian and Ubuntu:"
        " apt-get install libegl1 libgl1-mesa-dri (or libosmesa6)"
    )
