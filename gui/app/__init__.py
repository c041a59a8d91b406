"""What the window does: joins widgets, driving, ROS and the terminal."""
