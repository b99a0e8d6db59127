"""Tables: logs as pandas, CSV and Parquet, and foreign tables read by a layout.

`layout` describes the columns of a foreign table and `foreign` reads it; `table` converts a log to
a data frame and back; `convert` chooses between them and MCAP by the endings of the file names.
"""
