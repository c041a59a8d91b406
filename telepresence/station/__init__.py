"""`./stack up`: starts everything a station consists of, watches it, and ends it. No ROS imports, no Qt."""
