"""Parts of the sample museum: plan, shell, furnishing and textures."""
