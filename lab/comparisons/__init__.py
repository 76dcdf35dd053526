"""Methods and models on the same objects: statistics, the paper's tables for our runs, and charts."""
