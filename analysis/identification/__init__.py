"""Identification of a ship model from several logs, with validation on others.

`identify` is the sequence of the steps; each step has a module of its own. `fit` holds the
output-error fit to segments, `comparison` the other methods that are run beside it. Imports
`signals`, `filters`, `regression`, `replay` and `manoeuvres`.
"""
