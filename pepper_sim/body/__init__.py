"""Pepper's body in parts: joints, base, sensors, battery. SI units, no NAOqi words; `pepper_sim.robot` joins them."""
