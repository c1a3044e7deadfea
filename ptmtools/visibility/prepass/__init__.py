"""A first, quick bound of what each portal sees."""
