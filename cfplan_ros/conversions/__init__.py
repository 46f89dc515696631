"""Pure functions between the planner's data and the messages of ``cfplan_msgs``."""
