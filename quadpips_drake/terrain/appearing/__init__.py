"""Elements that are not there from the beginning: told, put into a plant, shown to cameras."""
