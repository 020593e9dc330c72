"""One short file a command: settings in, a typed request, a call, and what is printed at the end."""
