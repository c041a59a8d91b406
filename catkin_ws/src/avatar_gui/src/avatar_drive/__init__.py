"""Which operator's window drives: telepresence.teleop.drive_lease on ROS (`node`)."""
