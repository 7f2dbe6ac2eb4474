"""``quadpips motion-models``: what a velocity command does to base and feet, learned from walks."""
