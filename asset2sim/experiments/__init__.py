"""One runner of experiments: jobs to killable children to rows of a table, spread over Dask and resumable."""
