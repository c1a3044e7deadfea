"""The parts of `make_statues.py`."""
