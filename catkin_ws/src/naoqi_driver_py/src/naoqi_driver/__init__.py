"""ROS drivers for robots that speak NAOqi. Only `naoqi_node` and `head_topics` import rospy."""
