"""Between the pilot's velocity and the robot: a safety gate."""
