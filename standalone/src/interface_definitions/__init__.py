"""The files that define messages and services, one folder for each interface package."""
