"""The walk, simulated: what a client sees that has to fetch what it draws."""
