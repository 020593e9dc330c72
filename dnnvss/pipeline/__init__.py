"""The whole row, from corpus to face: the only place in the package that sees every room."""
