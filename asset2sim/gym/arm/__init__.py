"""The arm of the environment: its model, grippers, tasks, motions, and the recording of one."""
