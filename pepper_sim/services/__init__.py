"""The NAOqi services of the simulated Pepper: exactly one file each, named after the service."""

import pepper_sim.naoqi  # noqa: F401 -- sets libqi's environment before a service loads qi
