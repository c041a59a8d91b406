"""Widgets that show something; none of them knows ROS."""
