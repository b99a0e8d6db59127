"""MCAP files: the bytes of a log, written and read by columns.

Samples become records in `encode` and `writer`; `scan`, `summary` and `decode` turn records back
into columns; `reader` holds a whole log, `stream` yields it chunk by chunk. Imports nothing of
`shiplog.tables`, `shiplog.checks` or `shiplog.vessel`.
"""
