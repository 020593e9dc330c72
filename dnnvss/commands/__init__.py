"""One short file a command: settings in, a typed request, a call, and what is printed at the end."""

import os

# NumPy's threads that wait for work go to sleep after 2^20 cycles, a third of a millisecond, unless the environment
# says otherwise: by default they spin for so long that a video, which needs small products for every picture, keeps a
# core busy with waiting while it is encoded. It is read when NumPy is loaded, and so comes before.
os.environ.setdefault("OPENBLAS_THREAD_TIMEOUT", "20")
