"""Robotino's ROS driver: REST on one side, topics on the other."""
