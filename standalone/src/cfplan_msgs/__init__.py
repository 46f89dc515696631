"""Interface package cfplan_msgs."""
