"""The pilot's page: what a browser needs to see through a robot and to drive it. No ROS."""
