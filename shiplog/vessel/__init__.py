"""The vessel file: a ship's coefficients, steering gear, model and replay settings.

`vessel` parses the file and reports all its errors at once, `settings` defines every key of
`[filter]`, `[disturbance]` and `[identifier]`, `model_section` the `[model]`.
"""
