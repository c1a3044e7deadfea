"""Which portals lie on one straight line (Teller & Séquin 1991): of portals alone, not of cells."""
