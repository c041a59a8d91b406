"""A terminal inside the window, and the command lines that the buttons type into it."""
