"""Teleoperation: accounts and the drive lease, gamepads, and a filter for stale commands. No ROS, no Qt."""
