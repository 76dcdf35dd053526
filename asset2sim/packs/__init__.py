"""Refined objects as folders that other tools take as they are: a file a consumer, one writer for what all have."""
