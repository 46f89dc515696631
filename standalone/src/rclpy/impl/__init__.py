"""Parts of rclpy that code for ROS imports from here."""
