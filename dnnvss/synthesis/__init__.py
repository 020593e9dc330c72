"""From text, a voice or phone times to what a face does: requests and results. Knows nothing of commands."""
