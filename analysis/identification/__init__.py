"""Output-error identification of a ship model from several logs.

`identify` is the sequence of the steps; each step has a module of its own. `comparison` holds the
other methods that are run beside the fit. Imports `signals`, `filters`, `regression` and
`manoeuvres`.
"""
