"""NAOqi's messaging in plain Python."""
