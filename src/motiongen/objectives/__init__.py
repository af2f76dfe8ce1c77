"""Loss terms and the one place where they are weighted."""
