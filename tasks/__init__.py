"""The boundaries of a run as Prefect tasks, one module each; they call Asset2Sim's functions and hold no logic.

The stages of a single asset are not among them. A Prefect task on Dask costs 80 to 90 ms and a plain Dask future 2 ms
(measured, two cores), and an asset needs a killable child process of its own, which Prefect does not offer. So
``refine_assets`` is one task that spreads the assets as Dask futures, and ``tasks.pipeline`` runs their stages.
"""
