"""Speech around the face: engines that speak text, forced alignment, durations. Import from the modules."""
