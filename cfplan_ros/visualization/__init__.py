"""What viewers are shown: frames, markers, and a plan played in time."""
