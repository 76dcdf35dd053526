"""The bench of planted defects: one known defect in a clean object, to be caught by checks and mended by the loop."""
