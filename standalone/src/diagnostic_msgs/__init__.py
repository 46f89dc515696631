"""Interface package diagnostic_msgs."""
