"""Driving a robot by hand: who may drive, gamepads, and what happens to a command that comes late. No ROS, no Qt."""
