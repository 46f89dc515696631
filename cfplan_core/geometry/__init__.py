"""Plane geometry: polygons and the separation of their features."""
