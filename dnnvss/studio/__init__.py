"""One small server and its pages: labelling, and speaking with the service under it."""
