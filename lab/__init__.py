"""What is measured about the project itself: experiments, comparisons, judges, and the pages of the documentation."""
