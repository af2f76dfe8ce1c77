"""Generators: the staged generator, what its stages share, and the shell that trains it."""
