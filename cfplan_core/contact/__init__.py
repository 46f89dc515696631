"""Elemental contacts, their gaps and derivatives, and contact detection."""
