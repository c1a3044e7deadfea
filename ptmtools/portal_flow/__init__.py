"""Portals that lie on one straight line (Teller & Séquin 1991). Knows portals, not cells."""
