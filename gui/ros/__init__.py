"""The window's side of the ROS graph: topics to plain readings and back."""
