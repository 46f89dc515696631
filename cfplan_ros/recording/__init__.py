"""Recording of runs: one MCAP file for each service call, laid out as rosbag2 does it.

`Recorder` writes the files, `recovery` completes those whose writer died, `reading` says what
a file holds.
"""
