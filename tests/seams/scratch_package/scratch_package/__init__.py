"""What a user of quadpips_drake might add to it."""
