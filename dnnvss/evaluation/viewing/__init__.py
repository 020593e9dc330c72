"""Viewing tests: stimuli and designs, answers read strictly, and what may be concluded from them."""
