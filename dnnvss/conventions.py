"""The letters that shapes are written in, once for the whole package.

====== =====================================================================
letter meaning
====== =====================================================================
T      frames at the trajectory rate (100 a second unless configured)
F      frames of a video at its source rate
P      landmark points of a shape
D      parameters of the active appearance model
W      streams of a target: static, delta, delta-delta
C      columns of the feature table
B      frames or utterances of a batch
H, W_  height and width of an image in pixels
====== =====================================================================

Time is in seconds (float) unless a name says frames. Frame ``i`` at rate ``r`` stands for the interval
``[i / r, (i + 1) / r)`` and holds the value at its centre. Points are ``(x, y)`` in pixels, x to the right, y down, the
origin at the outer corner of the top left pixel. Images are ``uint8`` RGB, shape (H, W_, 3). Files are UTF-8.
"""
