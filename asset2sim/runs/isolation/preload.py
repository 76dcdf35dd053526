"""Imported once by the fork server, so that a child starts with the engines loaded: 13 ms instead of 2 s.

Never LiteLLM, Prefect or MLflow: they hold threads and hundreds of megabytes, and belong to the parent.
"""

import ctypes
import importlib
import logging
import os
import sys

MODULES = ("numpy", "scipy.spatial", "trimesh", "yourdfpy", "pybullet", "mujoco", "sapien", "tasks.pipeline")


def import_quietly(names: tuple[str, ...]) -> None:
    """Import modules with standard output and error sent nowhere: PyBullet prints its build time, from C.

    A module that cannot be imported is left out; the child that needs it meets the same error, and reports it.
    """
    kept = os.dup(1), os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        for name in names:
            try:
                importlib.import_module(name)
            except Exception as error:  # any: a fork server that dies here takes the whole run with it
                logging.getLogger(__name__).debug("cannot preload %s: %s", name, error)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        ctypes.CDLL(None).fflush(None)
        for target, descriptor in zip((1, 2), kept, strict=True):
            os.dup2(descriptor, target)
            os.close(descriptor)
        os.close(nowhere)


import_quietly(MODULES)
