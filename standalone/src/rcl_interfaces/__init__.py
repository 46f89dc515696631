"""Interface package rcl_interfaces."""
