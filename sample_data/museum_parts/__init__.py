"""What the sample museum is made of: its plan, shell, furnishing and textures."""
