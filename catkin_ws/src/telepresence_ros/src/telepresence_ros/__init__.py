"""The base of our ROS nodes: start and end, logs, diagnostics, and the topics that every robot has."""
