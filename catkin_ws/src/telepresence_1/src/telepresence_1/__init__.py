"""The pilot's picture on the robot's tablet, and the robot's picture on the pilot's screen.

`com_cam_node` and `rob_cam_node` know ROS; everything else does not.
"""
