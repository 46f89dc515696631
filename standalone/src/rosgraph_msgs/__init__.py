"""Interface package rosgraph_msgs."""
