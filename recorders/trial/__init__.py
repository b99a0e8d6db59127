"""Trials recorded from several sources into one log, as a trial file describes them.

`trial_file` parses the file; `live_source` joins live streams to one `recorders.source.Source`, and
`recorded_source` recorded ones; `status` holds what is heard, for the live display, the alarms and
the dry run; `marks` takes events that a person marks from another terminal. Knows no format of
packets: these are found by entry point.
"""
