"""A folder for PYTHONPATH: what programs on the simulated robot can import beside what this machine has."""
