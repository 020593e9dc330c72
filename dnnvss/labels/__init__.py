"""Where the feature tables were printed; ``dnnvss features`` does it now."""
