"""Topics, services and actions as rows of the link's table."""
