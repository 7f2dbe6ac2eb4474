"""What a log says about footholds, swings and walks."""
