"""A site: several robots, a unit of programs for each, and a proxy with one address and one list of them."""
