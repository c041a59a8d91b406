"""Driving a Robotino by hand: keyboard and gamepad."""
