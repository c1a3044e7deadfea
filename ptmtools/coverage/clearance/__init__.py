"""How far points are from surfaces, and what they are inside of (`matter`)."""
