"""The methods of the paper that ours is compared with."""
