"""Reads IFC through IfcOpenShell in a child process; the entry point is `reader.read_ifc`."""
