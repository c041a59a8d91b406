"""What runs beside NAOqi, on Python 2.7 too: the drive server. No ROS."""
