"""Cameras, sonars and lasers of Pepper: NAOqi's replies to arrays. Nothing in here knows ROS."""
