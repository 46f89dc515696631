"""Interface package trajectory_msgs."""
