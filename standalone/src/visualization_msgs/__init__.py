"""Interface package visualization_msgs."""
