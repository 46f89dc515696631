"""Interface package geometry_msgs."""
