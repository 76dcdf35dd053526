"""Motion loops and the size picture of an object's page: raw beside refined, made only for what changed."""
