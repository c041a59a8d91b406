"""Simulation: one MuJoCo world, its cameras, rays and scenes."""
