"""What ALVideoDevice is made of."""
