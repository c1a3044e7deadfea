"""What `benchmarks/house.py` measures and checks: sources, imports, names, parameters."""
