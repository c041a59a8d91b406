"""Driving from the window: keys, gamepad, a place on the floor, and the lease that decides who drives."""
