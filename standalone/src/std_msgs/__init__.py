"""Interface package std_msgs."""
