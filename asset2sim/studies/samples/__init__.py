"""The embedded sample dataset, objects of our own making in PartNet-Mobility's layout, and its generator."""

from asset2sim.studies.samples.dataset import blueprints, sample_files, write_samples
from asset2sim.studies.samples.planted import Planted, planted

__all__ = ["Planted", "blueprints", "planted", "sample_files", "write_samples"]
