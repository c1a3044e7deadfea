"""Square matrices of bits: who sees whom, over directed portals."""
