"""NMEA 0183 and IEC 61162-450: sentences of a ship's instruments, decoded to channels.

`framing` cuts lines and datagrams into sentences, the modules `*_sentences` decode one group of
sentences each, `sentence_decoder` joins them to a `recorders.streams.decoder.Decoder`,
`recorders.streams.gnss_clock` compares the receivers' own times with the times of reception, and
`twin_devices` finds talkers that are two devices. A file without time stamps gets its times in
`sentence_times`.

The library marlin (compiled from Rust) takes sentences apart and checks them. TAG blocks, and the
values of the fields and their status, are read here: marlin decodes ten kinds of sentences, without
those of steering, wind and depth. docs/nmea0183.md states the reasons for the choice.
"""
