"""Files of others, read within limits; our own, written whole or not at all."""
