"""Imported once by the fork server, so that a child starts with the engines and the pipeline loaded: 13 ms, not 2 s.

The environment variable ``PIPELINE_VARIABLE`` names the pipeline's module. LiteLLM, Prefect and MLflow are not loaded
here: they hold threads and hundreds of megabytes, and belong to the parent.
"""

import gc
import importlib
import logging
import os

from asset2sim.checks.known_reports import sources
from asset2sim.engines.console import silenced
from asset2sim.engines.registry import declared_engine, installed, modules_of, versions_of
from asset2sim.experiments.isolation.children import PIPELINE_VARIABLE
from schemas.vocabulary import DECIDING_PACKAGES

MODULES = (
    *("numpy", "scipy.spatial", "trimesh", "yourdfpy"),
    *(module for engine in installed() for module in modules_of(engine)),
)
"""And the engines with their adapters: each check runs in a fork of the child, and would import its engine's anew."""


def import_quietly(names: tuple[str, ...]) -> None:
    """Import modules with standard output and error sent nowhere: PyBullet prints its build time, from C.

    A module that cannot be imported is left out; the child that needs it meets the same error, and reports it.
    """
    with silenced():
        for name in names:
            try:
                importlib.import_module(name)
            except Exception as error:  # any: a fork server that dies here takes the whole run with it
                logging.getLogger(__name__).debug("cannot preload %s: %s", name, error)


import_quietly((*MODULES, *filter(None, [os.environ.get(PIPELINE_VARIABLE)])))
# A child would look each up anew, in 40 ms together.
versions_of(("asset2sim", *DECIDING_PACKAGES, *installed()))
sources()
with silenced():
    for engine in installed():
        declared_engine(engine).ready()
# What is loaded is there to stay: no child's garbage collector looks at it, 4 % of its time, or unshares its memory.
gc.freeze()
