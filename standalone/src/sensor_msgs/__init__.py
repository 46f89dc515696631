"""Interface package sensor_msgs."""
