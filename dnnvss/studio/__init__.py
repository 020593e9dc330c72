"""One small server and its pages: labelling."""
