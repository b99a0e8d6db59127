"""Replay of a log: plan, filter, disturbance observer, regression, residual tests, track.

`plan.plan_replay` makes two passes over the log and returns a `Plan`; `replay.Replay` runs the
`stages` over its chunks; `replay.analyse` does both in memory. The results are `replay_results`.
Imports `signals`, `filters`, `disturbance` and `regression`, never `identification`, `report`,
`view` or `check`.
"""
