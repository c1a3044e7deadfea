"""Tours: labels of works and rooms, and stops in order, in a file that museums write."""
