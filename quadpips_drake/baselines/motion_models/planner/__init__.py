"""Where feet may come down, the search over velocity commands, and the system that walks by both."""
