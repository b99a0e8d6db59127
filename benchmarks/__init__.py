"""What shiplog is fast at, measured against the straightforward peer in the same run."""
