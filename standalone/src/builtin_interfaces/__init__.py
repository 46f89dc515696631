"""Interface package builtin_interfaces."""
