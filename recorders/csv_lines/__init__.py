"""Lines of separated values, of devices that speak no standard, as a file describes them.

`device` reads the description: kinds of lines by their first field, and their columns as in the
layout of a table; `csv_decoder` reads the lines; `cli` makes it a format of streams.
"""
