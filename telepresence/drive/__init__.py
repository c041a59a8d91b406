"""Velocities to a robot's wheels over a network: signed datagrams, the pilot's end and the robot's end. No ROS."""
