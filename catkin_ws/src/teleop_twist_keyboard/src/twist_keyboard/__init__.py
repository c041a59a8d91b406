"""Keyboard driving: keys to velocities (`keys`), single keys from a terminal (`terminal`), both on ROS (`node`)."""
