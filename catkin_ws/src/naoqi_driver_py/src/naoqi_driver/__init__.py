"""ROS drivers for robots that speak NAOqi. `connection`, `drive`, `base`, `body` and `touch` do not know ROS."""
