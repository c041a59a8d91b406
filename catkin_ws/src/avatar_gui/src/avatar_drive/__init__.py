"""Which operator's window drives: telepresence.drive_lease on ROS (`node`)."""
