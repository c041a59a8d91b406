"""Simulated robots on ROS: the topics of the simulation guide, and what only a simulator knows."""
