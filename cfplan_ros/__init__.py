"""The ROS 2 side of cfplan: conversions and node around `cfplan_core`, without mechanics."""
