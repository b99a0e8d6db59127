"""Layouts: what the columns and fields of other programs' files mean as channels.

A layout file describes a foreign table, a device that sends lines of values, or the topics of an
MCAP file of another program. Its channel sections are the same in all of them. This folder reads
none of those files.
"""
