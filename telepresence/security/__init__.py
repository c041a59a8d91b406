"""What keeps strangers out, and what they send harmless. Standard library only."""
