"""The commands of ``cfplan`` that need ROS: call and start a planner, read and recover runs."""
