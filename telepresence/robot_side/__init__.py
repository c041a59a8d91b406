"""What programs on a robot need, in the common subset of Python 2.7 and 3. Standard library only."""
