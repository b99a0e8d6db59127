"""Tables: trials in pandas, CSV and Parquet, and foreign tables read by a layout.

`foreign` reads a foreign table by its layout. `long_form` converts a trial to a data frame and back
without loss, `csv_form` and `parquet_form` do the same with files, `wide` resamples it to one
column per quantity. `convert` chooses by the endings of file names. This folder must not import
recorders or estimators.
"""
