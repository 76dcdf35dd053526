"""Spreading the assets of a dataset over Dask workers, each asset in a child process of its worker."""
