"""Brings a Robotino up, real or simulated."""
