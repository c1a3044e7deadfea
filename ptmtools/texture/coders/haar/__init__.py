"""Haar differences, predicted and coded with rANS: `coder` says how."""
