"""Widgets that show readings; none of them knows ROS."""
