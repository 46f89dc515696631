"""The same examples on every run, on a machine of any speed."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile('repeatable', derandomize=True, deadline=None)
settings.load_profile('repeatable')
