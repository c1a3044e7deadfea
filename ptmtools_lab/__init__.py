"""The laboratory: a walk over a modelled link, its clients, and the price of options."""
