"""Simulated robots on ROS: what the simulation guide defines, and what only a simulator can tell."""
