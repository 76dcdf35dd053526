"""The methods that an asset's physics can come from: ours, and those that ours is compared with (paper, baselines)."""
