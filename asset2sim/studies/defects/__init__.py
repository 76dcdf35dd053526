"""The bench of planted defects: clean objects, one known defect each, and what our tests catch and the loop mends."""
