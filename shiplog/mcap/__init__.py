"""MCAP files: logs written and read by whole columns of samples.

Writing: `writer` collects channels, `encode` lays out their messages in MCAP chunks, and
`record_writer` writes the records of the file. Reading: `scan` goes through the records of a
file, `decompress` and `locate` find the messages in an MCAP chunk, `decode` collects them by
channel, and `trial_log` makes channels of them. `reader` holds a whole log, `stream` yields it
chunk by chunk, `summary` and `info` read only the end of the file. `schema` defines the messages,
`records` the binary structures.

An *MCAP chunk* is a compressed record of the file; a *chunk* of a log is what its `chunks` yields.
Imports nothing of `shiplog.tables`, `shiplog.checks` or `shiplog.vessel`.
"""
