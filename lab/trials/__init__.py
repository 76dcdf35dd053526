"""Recorded interactions: a scripted arm does a task with an object, and what is seen and felt meanwhile is kept."""
