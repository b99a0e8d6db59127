"""States from signals: filters that share one account of what they did, and the smoother."""
