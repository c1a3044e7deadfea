"""ptmtools: architectural scenes that stream."""
