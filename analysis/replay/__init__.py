"""The replay of a log: plan, filter, disturbance observer, regression, residuals.

`plan` makes two passes over the log and returns a `Plan`; `replay` runs the estimators over its
chunks. Imports `signals`, `filters`, `disturbance` and `regression`.
"""
