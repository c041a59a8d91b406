"""The pilot's picture on the robot's tablet. Nothing in here knows ROS but `nodes`, which the ROS programs are."""
