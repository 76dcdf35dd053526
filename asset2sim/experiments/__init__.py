"""The Dask cluster of a run or of experiments, what interrupts it, and killable children for each job."""
