"""The NAOqi services of the simulated Pepper: exactly one file each, named after the service."""
