"""The simulated Pepper's ROS surface."""
