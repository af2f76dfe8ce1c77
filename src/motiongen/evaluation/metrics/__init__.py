"""Pure metric functions: tensors in, numbers out. Docstrings give definition, unit, range, direction and source."""
