"""Contact models: which grasps are stable, which torques hold them, how the object moves."""
