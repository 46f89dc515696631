"""What the standalone rclpy stands on: message classes and the middleware."""
