"""``python -m dnnvss.pipeline.label``: frames to label by hand, and the page to label them on."""
