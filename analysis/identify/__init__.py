"""Identification that can be believed: ship models fitted to trials, with their uncertainty."""
