"""What is measured about the project itself: speed, methods, defects, an independent checker, and the documentation."""
