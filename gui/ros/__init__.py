"""The window's side of the ROS graph: converts topics to plain readings and back."""
