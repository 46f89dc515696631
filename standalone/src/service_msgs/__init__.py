"""Interface package service_msgs."""
