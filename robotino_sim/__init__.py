"""A simulated Robotino that answers RobotinoOS's REST interface."""
