"""A second world for the machined parts: contact, noise and scan share no code and no model with `touchup simulate`."""
