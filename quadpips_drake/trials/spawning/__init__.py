"""What appears in the world while a trial goes on."""
