"""The plan as a user sees it: frames in time, torque limits, segments, and its file."""
