"""Objects of our own making in categories that the shared data lack, with what a person expects of each."""
