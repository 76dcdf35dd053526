"""The catalog: Parquet tables of what was done to each asset, queries over them, and MLflow's record of each run."""
