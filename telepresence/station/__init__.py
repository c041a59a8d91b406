"""`./stack up` and `./stack doctor`: start, watch, end and check the programs of a station. No ROS imports, no Qt."""
