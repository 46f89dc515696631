"""Execution of plans in a physics engine that knows nothing of the planner's mechanics."""
