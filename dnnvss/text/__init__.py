"""Words in, a linguistic tree out: normalisation, pronunciation, homographs, syllables. Knows nothing of audio.

Import from the modules: :mod:`~dnnvss.text.lexicon`, :mod:`~dnnvss.text.tree`, :mod:`~dnnvss.text.sentence`.
"""
