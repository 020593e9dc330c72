"""The run folder and the bundle: the only place that knows the names of files in it."""
