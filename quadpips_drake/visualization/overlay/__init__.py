"""What is written over moving pictures: legend, clock, status."""
