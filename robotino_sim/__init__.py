"""A simulated Robotino that answers RobotinoOS REST requests."""
