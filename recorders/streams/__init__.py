"""Streams of packets: what all recorders of real sensors share, whatever the format of the data.

Data flow one way: a *transport* yields batches of `Packet`s (from a file, a serial line, a socket,
a CAN bus), stages such as `stamps` take and yield batches, a `Decoder` turns the packets into
samples and events in a `SampleBuffer`, and `StreamSource` makes it a `recorders.source.Source`.
The formats (NMEA 0183, NMEA 2000, ...) are in their own folders, which this one must not import.
"""
