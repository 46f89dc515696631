"""Search: tracing contact formations, transitions between them, the two CF-trees."""
