"""What the services that perceive people share: who is known (population), and the base of their extractors."""
