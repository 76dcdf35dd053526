"""The stages of one asset, a module each, and the pipeline that runs them in order; nothing of Prefect or Dask.

A Prefect task on Dask costs 80 to 90 ms and a plain Dask future 2 ms (measured, two cores), and an asset needs a
killable child process of its own, which Prefect does not offer. So a run's boundaries are Prefect tasks
(``flows.refine_dataset``), one of which spreads the assets as Dask futures, and each asset's child runs
``tasks.pipeline``.
"""
