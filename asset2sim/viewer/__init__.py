"""The viewer: refined objects in a live simulation that a person can touch, beside the raw ones, with their reviews."""
