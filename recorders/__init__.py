"""Sources of samples, and the loop that writes them to a log."""
