"""The embedded sample dataset, objects of our own making in PartNet-Mobility's layout, and its generator."""
