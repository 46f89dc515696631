"""Interface package unique_identifier_msgs."""
