"""Importing SAPIEN without what it says about graphics: it looks for Vulkan when imported, and we never draw."""

import warnings
from types import ModuleType


def physx() -> tuple[ModuleType, ModuleType]:
    """The modules ``sapien`` and ``sapien.physx``; no graphics device is touched."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import sapien
        import sapien.physx

    return sapien, sapien.physx
