"""Interface package tf2_msgs."""
