"""NAOqi services of the simulated Pepper, one file each."""
