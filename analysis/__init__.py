"""What a trial says: states, disturbances, coefficients, and how far to trust them."""
