"""NMEA 0183 and IEC 61162-450: sentences of a ship's instruments, decoded to channels.

`framing` cuts lines and datagrams into sentences and checks them, the modules `*_sentences` decode
one group of sentences each, `sentence_decoder` joins them to a `recorders.streams.decoder.Decoder`,
`recorders.streams.gnss_clock` compares the receivers' own times with the times of reception, and
`twin_devices` finds talkers that are two devices. A file without time stamps gets its times in
`sentence_times`.

No parser library is used at run time. pynmea2 1.19 parses fast, but raises an exception for each
kind that it does not know (THS, ROR, HTC, HTD, DBS), and leaves status and numbers to be checked;
pynmeagps parses half as many sentences a second as pass the whole way from the file to the log here
(`python -m benchmarks.sentences`). Both are references of the tests.
"""
