"""The actions of the corpus: one function each, written as keys of an `Actor`."""
