"""MCAP files of other programs: messages of ROS 2, protobuf and JSON read by a layout.

`message_decoders` decodes messages, `field_values` finds values by their paths, `topic_samples`
makes samples of one topic, and `foreign_log` reads a whole file as a trial; `ulog` copies a ULog
file of PX4 to such a file. Clocks are checked as those of any log. This folder must not import
tables.
"""
