"""What words mean: prompts and labels read into sizes, states, parts and materials, from tables."""
