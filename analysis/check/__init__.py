"""The regression check: a replay compared with its reference, channel by channel."""
