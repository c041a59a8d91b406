"""Recording a session as a ROS bag, and the report of it."""
