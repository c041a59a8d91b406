"""The simulated Pepper's ROS interface."""
