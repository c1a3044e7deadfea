"""What the sample campus is made of."""
