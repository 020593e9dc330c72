"""Kinds of faces, behind one protocol. Knows nothing of text and training."""
